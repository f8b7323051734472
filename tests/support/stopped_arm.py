"""What tests of stops need: an arm that tells of its stops, and patience without a stopwatch."""

import os
import threading
from contextlib import contextmanager
from pathlib import Path

from palpate.core.errors import DeviceError
from palpate.core.ports import JointCommand
from tests.fake_devices import FakeArm
from tests.wall_clock.late import wait_for

HERE = JointCommand((0.0,))


class StoppedArm(FakeArm):
    """Counts its stops, and by which threads they came; may be gone, so that even ``stop`` fails."""

    def __init__(self, clock):
        super().__init__(clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1)
        self.stops = []
        self.gone = False

    def stop(self):
        self.stops.append(threading.current_thread().name)
        if self.gone:
            raise DeviceError("arm", "is gone")
        super().stop()


def active_arm(clock):
    arm = StoppedArm(clock)
    arm.configure()
    arm.activate()
    return arm


@contextmanager
def nothing_left_behind():
    """No thread and no open file more than before."""
    threads, files = threading.active_count(), open_files()
    yield
    # A thread that a busy machine holds up is not waited for by whoever ends it, at most for a second.
    wait_for(lambda: threading.active_count() == threads)
    assert open_files() == files


def open_files():
    found = {}
    for entry in Path("/proc/self/fd").iterdir():
        try:
            found[entry.name] = os.readlink(entry)
        except FileNotFoundError:
            continue  # the listing's own
    return found
