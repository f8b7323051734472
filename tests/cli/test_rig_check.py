"""``palpate rig check``: adapters that keep their contracts and adapters that do not."""

import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "third_party_rig"


@pytest.fixture
def example(palpate, monkeypatch):
    """Called in the example's folder."""
    monkeypatch.chdir(EXAMPLE)
    return palpate


@pytest.fixture(autouse=True)
def _forget_modules():
    """A process of its own imports each adapter anew; here that has to be seen to."""
    before = set(sys.modules)
    yield
    # What is installed stays: who has it already would see two of it.
    for name in set(sys.modules) - before:
        if not name.startswith("palpate.") and "site-packages" not in (
            getattr(sys.modules[name], "__file__", "") or ""
        ):
            del sys.modules[name]


@pytest.mark.parametrize(
    ("name", "flags", "counts"),
    [
        ("ArmChecks", ("--moves",), "13 passed"),
        ("EncoderChecks", ("--moves",), "9 passed"),
        ("ForceChecks", (), "10 passed"),
        ("ArmChecks", (), "4 passed, 9 skipped"),
    ],
)
def test_example_keeps_its_contract(example, name, flags, counts):
    printed = example.succeed("rig", "check", f"third_party_rig.checks:{name}", *flags)
    assert counts in printed
    assert ("--moves tries them on a simulated arm" in printed) == ("skipped" in counts)


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


def test_broken_adapter_is_judged_clause_by_clause(palpate):
    Path("mine.py").write_text(BROKEN)
    done = palpate("rig", "check", "mine:Checks")
    assert done.code == 1
    assert "test_life_follows_the_table FAILED" in done.stdout
    assert "observed no error, but None; the contract wants LifecycleError for reading" in done.stdout
    assert "test_silence_is_marked SKIPPED" in done.stdout
