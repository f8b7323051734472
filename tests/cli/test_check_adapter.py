"""``palpate check-adapter``: the shipped example keeps its contracts, broken adapters do not, wrong names are told."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.integration.command_line import palpate, refusal

EXAMPLE = Path(__file__).parents[2] / "examples" / "line_arm"


@pytest.mark.parametrize(("name", "clauses"), [("ArmChecks", 29), ("EncoderChecks", 28)])
def test_the_example_keeps_its_contract(name: str, clauses: int) -> None:
    done = palpate("check-adapter", f"checks:{name}", cwd=EXAMPLE)
    assert done.returncode == 0, done.stdout
    assert f"{clauses} clauses" in done.stdout
    assert "0 failed" in done.stdout


BROKEN = """
from palpate.core.ports.contracts.fakes import FakeClock, FakeForceSensor
from palpate.core.ports.contracts import ForceSensorRig

class Broken(FakeForceSensor):
    def read(self):
        return None
    def close(self):
        raise RuntimeError("never")

def rig():
    clock = FakeClock()
    return ForceSensorRig(device=Broken(clock), clock=clock, advance=clock.advance, max_age_ns=1)

def fails():
    raise RuntimeError("no hardware here")

number = 3

class Bare:
    def __init__(self):
        self._clock = FakeClock()
    def now_ns(self):
        return self._clock.now_ns()
    def sleep_until(self, deadline_ns):
        pass
"""


@pytest.fixture
def laboratory(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(BROKEN)
    (tmp_path / "unwell.py").write_text("1 / 0\n")
    return tmp_path


def test_a_broken_adapter_is_told_clause_by_clause(laboratory: Path) -> None:
    done = palpate("check-adapter", "mine:rig", cwd=laboratory)
    assert done.returncode == 1
    assert "Traceback" not in done.stdout + done.stderr
    assert "failed          ``close`` works in every state" in done.stdout
    assert "it raised RuntimeError: never" in done.stdout
    assert "failed          The sample names the frame" in done.stdout
    assert "passed          The adapter has every method of its port." in done.stdout


def test_an_adapter_without_a_rig_is_tried_as_far_as_that_goes(laboratory: Path) -> None:
    done = palpate("check-adapter", "mine:Bare", cwd=laboratory)
    assert done.returncode == 1
    assert "the contract of Clock" in done.stdout


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("mine", "package.module:Name"),
        (":Bare", "package.module:Name"),
        ("missing:Name", "No module named 'missing'"),
        ("unwell:Name", "ZeroDivisionError"),
        ("mine:Nobody", "it has no Nobody"),
        ("mine:number", "package.module:Name"),
        ("mine:fails", "no hardware here"),
        ("palpate.core.ports.contracts.fakes:FakeArm", "calling it failed"),
    ],
)
def test_names_that_lead_nowhere(laboratory: Path, name: str, reason: str) -> None:
    assert reason in refusal("check-adapter", name, cwd=laboratory)
