"""Settings for the tests that need the wall clock."""

import os

import pytest

from palpate.adapters.hardware.real_time import take_real_time

PRIORITY = 20


@pytest.fixture
def real_time():
    """Driver and emulated devices in this process are not held up by other work, where the system grants it.

    Not for what computes for long: the kernel puts the whole class aside when it takes more than 95 % of a second.
    """
    granted = take_real_time(PRIORITY).granted
    try:
        yield
    finally:
        if granted:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
