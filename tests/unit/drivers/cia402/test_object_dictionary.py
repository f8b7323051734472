import pytest

from palpate.drivers.cia402 import DriveState
from palpate.drivers.cia402.object_dictionary import PATTERNS, state_of

# Statuswords as drives send them: state bits with voltage, remote, target and warning bits set or not.
WORDS = {
    DriveState.NOT_READY: (0x0000, 0x0200, 0x0090, 0x0020),
    DriveState.SWITCH_ON_DISABLED: (0x0040, 0x0250, 0x0660, 0x02F0),
    DriveState.READY: (0x0021, 0x0231, 0x16B1),
    DriveState.SWITCHED_ON: (0x0023, 0x0233, 0x16B3),
    DriveState.ENABLED: (0x0027, 0x0237, 0x1637, 0x12B7),
    DriveState.QUICK_STOP: (0x0007, 0x0217, 0x1617),
    DriveState.FAULT_REACTION: (0x000F, 0x021F, 0x022F),
    DriveState.FAULT: (0x0008, 0x0208, 0x0238),
}


@pytest.mark.parametrize(("state", "word"), [(state, word) for state, words in WORDS.items() for word in words])
def test_a_statusword_is_read_by_mask(state: DriveState, word: int) -> None:
    assert state_of(word) is state


@pytest.mark.parametrize("word", [0x0001, 0x0025, 0x0002, 0x0067 & ~0x20 | 0x08])
def test_a_statusword_that_fits_no_pattern_is_no_state(word: int) -> None:
    assert state_of(word) is None


def test_no_statusword_fits_two_patterns() -> None:
    for word in range(0x80):
        assert sum(word & mask == value for _, mask, value in PATTERNS) <= 1
