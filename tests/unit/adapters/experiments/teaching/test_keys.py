import os
import pty
import termios

import pytest

from palpate.adapters.experiments.teaching import Keys
from palpate.core.policy import COMPASS_NAMES
from tests.unit.adapters.samples import observation


def steps(keys: Keys) -> list[str]:
    """Names of the steps until the lesson ends; rests are ``.``."""
    found = []
    while True:
        way = keys.step(observation())
        if keys.ended():
            return found
        found.append("." if way is None else COMPASS_NAMES[way])


@pytest.mark.parametrize(
    ("typed", "names"),
    [
        (b"\x1b[A\x1b[B\x1bOC\x1b[D", ["+x", "-x", "+y", "-y"]),
        (b"wEdcxzaq", ["+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y"]),
        (b"5 7#?8", [".", ".", "+x-y", "+x"]),
    ],
)
@pytest.mark.parametrize("end", [b"\x1b", b"\x04"])
def test_keys_of_a_terminal_come_without_enter_and_it_is_left_as_it_was(
    typed: bytes, names: list[str], end: bytes
) -> None:
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    with Keys(theirs) as keys:
        os.write(ours, typed + end)
        assert steps(keys) == names
        assert keys.held
    assert termios.tcgetattr(theirs) == before
    os.close(ours)
    os.close(theirs)


def test_the_end_of_a_pipe_and_a_request_end_the_lesson() -> None:
    reading, writing = os.pipe()
    os.write(writing, b"w")
    os.close(writing)
    keys = Keys(reading)
    assert steps(keys) == ["+x"]
    os.close(reading)
    keys = Keys(-1)
    keys.end()
    assert (keys.step(observation()), keys.ended()) == (None, True)
