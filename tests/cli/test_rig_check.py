"""``palpate rig check``: adapters that keep their contracts and adapters that do not."""

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from threading import Event

import pytest

from palpate.adapters.cli.rig_check import run_within
from palpate.adapters.contracts import ClauseOutcome, run_clauses
from tests.command_line import CommandLine
from tests.contracts import unsafe
from tests.fake_devices import FakeForceSensor

EXAMPLE = Path(__file__).parents[2] / "examples" / "third_party_rig"


@pytest.fixture
def example(palpate: CommandLine, monkeypatch: pytest.MonkeyPatch) -> CommandLine:
    """Called in the example's folder."""
    monkeypatch.chdir(EXAMPLE)
    return palpate


@pytest.fixture(autouse=True)
def _forget_modules() -> Iterator[None]:
    """A process of its own imports each adapter anew; here that has to be seen to."""
    before = set(sys.modules)
    yield
    # What is installed stays: who has it already would see two of it.
    for name in set(sys.modules) - before:
        if not name.startswith("palpate.") and "site-packages" not in (
            getattr(sys.modules[name], "__file__", "") or ""
        ):
            del sys.modules[name]


MOVES = ("--moves", "--rate-rad-s", "0.2", "--reach-rad", "0.15")


@pytest.mark.parametrize(
    ("name", "flags", "counts"),
    [
        ("ArmChecks", MOVES, "12 passed, 0 failed, 1 not applicable"),
        ("EncoderChecks", MOVES, "9 passed, 0 failed, 0 not applicable"),
        ("ForceChecks", (), "10 passed, 0 failed, 0 not applicable"),
        ("ArmChecks", (), "4 passed, 0 failed, 9 not applicable"),
    ],
)
def test_the_example_keeps_its_contract(example: CommandLine, name: str, flags: tuple[str, ...], counts: str) -> None:
    assert counts in example.succeed("rig", "check", f"third_party_rig.checks:{name}", *flags)


def test_what_will_move_is_said_before_anything_does(example: CommandLine) -> None:
    printed = example.succeed("rig", "check", "third_party_rig.checks:ArmChecks", *MOVES)
    plan, clauses = printed.split("third_party_rig.checks:ArmChecks: 13 clauses")
    assert "joint 3 by 0.1007 rad, to its limit at 0.4 rad" in plan
    assert "at most 0.2 rad/s a joint" in plan
    assert "passed" in clauses


@pytest.mark.parametrize(
    ("flags", "reason"),
    [
        (("--moves",), "rate_rad_s = 0.0 is refused"),
        (("--moves", "--rate-rad-s", "0.1"), "reach_rad = 0.0 is refused"),
        (("--rate-rad-s", "0.1"), "with --moves only"),
        (("--moves", "--rate-rad-s", "0.0001", "--reach-rad", "1"), "more than 0.00056 rad/s"),
    ],
)
def test_moves_are_refused_without_rates(example: CommandLine, flags: tuple[str, ...], reason: str) -> None:
    assert reason in example.refusal("rig", "check", "third_party_rig.checks:ArmChecks", *flags)


BROKEN = """
from palpate.adapters.contracts import FakeClock
from tests.fake_devices import FakeForceSensor
from palpate.adapters.contracts import ForceSensorContract, ForceSensorRig

class Broken(FakeForceSensor):
    def read(self):
        return None
    def close(self):
        raise RuntimeError("never")

class Checks(ForceSensorContract):
    def make(self):
        clock = FakeClock()
        return ForceSensorRig(device=Broken(clock), clock=clock, advance=clock.advance, max_age_ns=1)
"""


@pytest.fixture
def laboratory(tmp_path: Path) -> Path:
    """The working directory, with an adapter that breaks its contract."""
    (tmp_path / "mine.py").write_text(BROKEN)
    return tmp_path


@pytest.mark.usefixtures("laboratory")
def test_a_broken_adapter_is_judged_clause_by_clause(palpate: CommandLine) -> None:
    done = palpate("rig", "check", "mine:Checks")
    assert done.code == 1
    assert "Traceback" not in done.stdout + done.stderr
    assert "failed          In any order of requests, work, faults and cut cables" in done.stdout
    assert "observed no error, but None; the contract wants LifecycleError for reading" in done.stdout
    assert "failed          Each sample is of its type" in done.stdout
    assert "not applicable  Once the newest sample is over age" in done.stdout


def test_a_clause_that_blocks_is_given_up() -> None:
    suite = unsafe.FORCE.trying(type("Blocks", (FakeForceSensor,), {"read": lambda self: Event().wait()}))
    results = run_clauses(suite, partial(run_within, 0.3))
    failures = [result for result in results if result.outcome is ClauseOutcome.FAILED]
    assert ["blocks" in result.message for result in failures] == [True]
