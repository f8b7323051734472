"""Real-time display of a simulated rig in MuJoCo's passive viewer. It does not change a single bit of a trial."""

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

from typing_extensions import override

from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import UsageError
from palpate.core.ports import Clock
from palpate.simulation.work_cell import WorkCell

DISPLAYS: Final = ("DISPLAY", "WAYLAND_DISPLAY")
_BEHIND_S: Final = 0.1
"""Delay above which the viewer no longer catches up, for example after a pause."""


class _ViewedClock(Clock):
    """Simulator clock that is slowed to real time and shows each tick. Closing the window ends the run."""

    def __init__(self, clock: Clock, window: Any, cell: WorkCell) -> None:
        self._clock, self._window, self._cell = clock, window, cell
        self._model, self._data = cell.model, cell.data
        self._lead_s = self._ahead_s()

    @override
    def now_ns(self) -> int:
        return self._clock.now_ns()

    @override
    def sleep_until(self, deadline_ns: int) -> None:
        self._clock.sleep_until(deadline_ns)
        early_s = self._ahead_s() - self._lead_s
        time.sleep(max(early_s, 0.0))
        if early_s < -_BEHIND_S:
            self._lead_s += early_s
        if not self._window.is_running():
            signal.raise_signal(signal.SIGINT)
            return
        if self._cell.data is not self._data:
            # The cell has another model by now; the window keeps the one it was opened with.
            self._cell.pose(self._model, self._data)
        self._window.sync()

    def _ahead_s(self) -> float:
        return self._clock.now_ns() * 1e-9 - time.monotonic()


@contextmanager
def viewed(rig: SimulatedRig) -> Iterator[None]:
    """Show the rig in a window until the context exits.

    Raises:
        UsageError: There is no display.
    """
    if sys.platform.startswith("linux") and not any(os.environ.get(name) for name in DISPLAYS):
        instead = "palpate render makes videos of recorded trials without a display"
        raise UsageError(f"there is no display ({' and '.join(DISPLAYS)} are not set); {instead}")
    import mujoco.viewer

    before, ports = set(threading.enumerate()), rig.ports
    window = mujoco.viewer.launch_passive(rig.cell.model, rig.cell.data, show_left_ui=False, show_right_ui=False)
    drawing = set(threading.enumerate()) - before
    try:
        with window.lock():
            window.cam.lookat[:] = rig.cell.data.site("tip").xpos
            window.cam.distance, window.cam.azimuth, window.cam.elevation = 0.4, 90.0, -20.0
        rig.ports = replace(ports, clock=_ViewedClock(ports.clock, window, rig.cell))
        yield
    finally:
        rig.ports = ports
        window.close()
        # The window's thread reads the model until the window is closed.
        for thread in drawing:
            thread.join(10.0)
