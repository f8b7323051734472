import pytest

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.ur import judge_angles


@pytest.mark.parametrize(
    ("fresh", "got_Hz", "remedy"),
    [
        (390, 140.0, ""),
        (390, 130.7, "end other work on this computer"),
        (300, 140.0, "connect controller and computer"),
    ],
)
def test_a_late_cycle_with_new_angles_is_this_computers_and_one_without_is_the_wires(
    fresh: int, got_Hz: float, remedy: str
) -> None:
    notes = Notebook("arm")
    judge_angles([True] * fresh + [False] * (390 - fresh), got_Hz, 140.0, notes)
    (finding,) = notes.section().findings
    assert finding.remedy.startswith(remedy)
    assert bool(finding.remedy) == bool(remedy)
