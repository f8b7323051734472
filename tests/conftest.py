"""Settings for all tests."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

from palpate.adapters.realtime import take_real_time

# The same examples at every run, and no stopwatch: a busy machine must not fail a property.
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")


@pytest.fixture
def real_time() -> Iterator[None]:
    """Emulated devices and driver within this process are not held up by other tests, where the system grants it."""
    granted = take_real_time(20).granted
    try:
        yield
    finally:
        if granted:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
