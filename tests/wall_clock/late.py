"""Lateness, which may be the host's: a test that ends by it is tried again, see ``tests/conftest.py``."""

import re
import time
from contextlib import contextmanager

from palpate.core.ports import JointCommand


class TooLateError(AssertionError):
    """Something did not come about in time."""


def wait_for(condition, within_s=30.0):
    """Wait until something has come about, and return it; too late only after a time that no busy machine needs."""
    deadline_s = time.monotonic() + within_s
    while not (found := condition()):
        if time.monotonic() > deadline_s:
            raise TooLateError(f"it did not come about within {within_s} s")
        time.sleep(0.002)
    return found


@contextmanager
def late_if(match, *kinds):
    """An error in here of one of these kinds, and that says so, comes of lateness. A wrong value never is of them."""
    try:
        yield
    except kinds as error:
        if re.search(match, str(error)):
            raise TooLateError(str(error)) from error
        raise


def lead(arm, goal_rad, seconds):
    """Send an arm to a pose, tick by tick."""
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        arm.send(JointCommand(goal_rad))
        arm.read()
        time.sleep(0.007)
