"""Trials as they run, in MuJoCo's viewer: a clock that never runs ahead of real time and shows each tick."""

import os
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, Protocol

from typing_extensions import override

from palpate.adapters.hardware import MonotonicClock
from palpate.core.errors import UsageError, one_line
from palpate.core.ports import Clock

DISPLAYS: Final = ("DISPLAY", "WAYLAND_DISPLAY")
_NS: Final = 1_000_000_000
_PATIENCE_S: Final = 10.0
_DISTANCE_M: Final = 0.4
_INSTEAD: Final = "palpate render makes films of recorded trials without a display"
_BEHIND_NS: Final = _NS // 10
"""A picture that is later than this is not made up for: as after a pause, or on a machine that is too slow."""


class Viewer(Protocol):
    """What is used of MuJoCo's passive viewer."""

    def sync(self) -> None:
        """Show the present state."""

    def is_running(self) -> bool:
        """Whether its window is still open."""


class WindowClosedError(Exception):
    """Somebody closed the window: no error, but the way out of a running trial."""


class ShownClock(Clock):
    """The simulator's clock, held back to real time and shown. Trials come out as without it, bit for bit."""

    def __init__(
        self,
        simulated: Clock,
        viewer: Viewer,
        speed: float,
        real: Clock | None = None,
    ) -> None:
        self._simulated, self._viewer, self._speed = simulated, viewer, speed
        self._real = real if real is not None else MonotonicClock()
        self._begin()

    @override
    def now_ns(self) -> int:
        return self._simulated.now_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        """Let the cell move on, wait for real time, and show.

        Raises:
            WindowClosedError: Nobody watches any more.
        """
        self._simulated.sleep_until(deadline_ns)
        due_ns = self._real_origin_ns + round((deadline_ns - self._origin_ns) / self._speed)
        now_ns = self._real.now_ns()
        if now_ns > due_ns + _BEHIND_NS:
            self._begin()
        elif now_ns < due_ns:
            self._real.sleep_until(due_ns)
        if not self._viewer.is_running():
            raise WindowClosedError
        self._viewer.sync()

    def _begin(self) -> None:
        self._origin_ns, self._real_origin_ns = self._simulated.now_ns(), self._real.now_ns()


@contextmanager
def open_viewer(model: Any, data: Any, target_m: tuple[float, float, float]) -> Iterator[Viewer]:
    """MuJoCo's viewer in a window of its own, for as long as this lasts.

    Args:
        data: Its state; shown at each ``sync``.

    Raises:
        UsageError: There is no display, or no window can be opened on it.
    """
    require_display()
    import mujoco.viewer

    before = set(threading.enumerate())
    window = mujoco.viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
    drawing = [thread for thread in threading.enumerate() if thread not in before]
    try:
        with window.lock():
            window.cam.lookat[:] = target_m
            window.cam.distance, window.cam.azimuth, window.cam.elevation = _DISTANCE_M, 90.0, -20.0
        yield window
    finally:
        window.close()
        # Closing only requests it: until the window is gone its thread reads the model, which must not go before.
        for thread in drawing:
            thread.join(_PATIENCE_S)


def require_display() -> None:
    """Make sure that a window can be opened: MuJoCo itself would wait for ever, or end the process.

    Raises:
        UsageError: It cannot.
    """
    if sys.platform.startswith("linux") and not any(os.environ.get(name) for name in DISPLAYS):
        raise UsageError(f"there is no display ({' and '.join(DISPLAYS)} are not set); {_INSTEAD}")
    with warnings.catch_warnings():
        # GLFW reports its errors as warnings, and the library may be missing altogether.
        warnings.simplefilter("error")
        try:
            import glfw

            opened = glfw.init()
            glfw.window_hint(glfw.VISIBLE, False)
            window = glfw.create_window(64, 64, "palpate", None, None) if opened else None
            if window:
                glfw.destroy_window(window)
                glfw.default_window_hints()
        except (Warning, ImportError, AttributeError) as error:
            raise UsageError(f"no window can be opened ({one_line(error)}); {_INSTEAD}") from error
    if not window:
        raise UsageError(f"no window can be opened; {_INSTEAD}")
