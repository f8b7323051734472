import pytest

from palpate.adapters.hardware.doctor import FindingsSection, Level, section_text, summary_text
from palpate.adapters.hardware.doctor.findings import Finding, Notebook
from palpate.adapters.hardware.errors import translating
from palpate.core.errors import PalpateError
from palpate.drivers.errors import SilentError


def section() -> FindingsSection:
    notes = Notebook("arm: some")
    notes.fact("rate", "70 Hz")
    notes.fact("a longer name", "word " * 40)
    notes.table(("axis", "joint (rad)"), (("1", "+0.5"), ("2", "-12.25")))
    notes.ok("it answers")
    notes.wrong("a joint is lost", "find /dev/a-very-long-name-that-must-stay-whole")
    return notes.section()


def test_columns_are_aligned() -> None:
    lines = section_text(section()).splitlines()
    assert lines[0] == "arm: some"
    assert lines[1] == "  rate           70 Hz"
    assert all(len(line) <= 118 for line in lines)
    table = [line for line in lines if "rad" in line or "0.5" in line or "12.25" in line]
    assert len({len(line) for line in table}) == 1


def test_a_remedy_stands_below_what_it_mends() -> None:
    lines = section_text(section()).splitlines()
    place = lines.index("  wrong  a joint is lost")
    assert lines[place + 1] == "         -> find /dev/a-very-long-name-that-must-stay-whole"


def test_the_summary_counts() -> None:
    assert summary_text([section()]) == "1 thing wrong, 0 notes\n"
    assert summary_text([FindingsSection("a", findings=(Finding(Level.NOTE, "b"),))]) == "all well, 1 note\n"


def test_what_is_wrong_has_a_remedy() -> None:
    with pytest.raises(ValueError, match="no remedy for: a"):
        Finding(Level.WRONG, "a")


def test_a_driver_speaks_for_itself() -> None:
    notes = Notebook("arm")
    try:
        with translating("arm"):
            raise SilentError("drive 3", "is silent", "plug it in")
    except PalpateError as error:
        notes.error(error)
    notes.error(KeyError("port"))
    first, second = notes.section().findings
    assert (first.text, first.remedy) == ("drive 3: is silent", "plug it in")
    assert second.text == "KeyError: 'port'"
