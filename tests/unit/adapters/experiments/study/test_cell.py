import re

from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.experiments.study.cell import StudyCell

VALUES = st.one_of(st.floats(allow_nan=False), st.booleans(), st.text(), st.lists(st.text()))
CELLS = st.builds(
    StudyCell,
    st.dictionaries(st.sampled_from(["task.step_mm", "arm", "perception.channels"]), VALUES),
    st.text(min_size=1),
    st.integers(0, 2**63 - 1),
)


@given(CELLS)
def test_a_name_is_a_safe_file_name(cell: StudyCell) -> None:
    assert re.fullmatch(r"[A-Za-z0-9.+_-]{1,140}", cell.name)
    assert not cell.name.startswith(".")
    assert not cell.name.endswith(".unfinished")


@given(CELLS, CELLS)
def test_different_cells_have_different_names(a: StudyCell, b: StudyCell) -> None:
    assert (a.name == b.name) == (repr(a.document()) == repr(b.document()))


def test_a_name_can_be_read_and_does_not_depend_on_the_order_of_fields() -> None:
    cell = StudyCell({"task.step_mm": 0.5, "arm": "ur5"}, "runs/paper/policy.json", 3)
    assert cell.name.startswith("paper-arm-ur5-step_mm-0.5-seed-003-")
    other = StudyCell({"arm": "ur5", "task.step_mm": 0.5}, cell.policy, 3)
    assert other.document() == cell.document()
    assert other.name == cell.name


def test_it_says_what_it_is() -> None:
    assert str(StudyCell({"task.step_mm": 0.5}, "torque", 3)) == "task.step_mm = 0.5, torque, seed 3"
