"""A gamepad, by the events of Linux's joystick interface (``Documentation/input/joydev/joystick-api.rst``)."""

import os
import select
import struct
import time
from collections.abc import Callable
from typing import Final, Self

from typing_extensions import override

from palpate.adapters.experiments.teaching.hand import Hand, compass_index
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.policy import Observation

_EVENT: Final = struct.Struct("=IhBB")
"""Time in ms, value, type, number of axis or button."""
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_FULL: Final = 32767.0
_LEAST: Final = 0.5
"""Share of the full way from which a stick counts as pushed."""
_STICKS: Final = ((0, 1), (6, 7))
"""Axes to the right and towards the person: of the left stick, and of a cross of buttons."""
_POLL_S: Final = 0.1
_MOST_READS: Final = 256
"""A person moves a stick more slowly than this is read; a device without end would hold up the arm's loop."""


class Gamepad(Hand):
    """A stick for the direction and, on a rig, a button that must be held for the arm to move.

    A stick pushed away from the person is +x, to the right +y. Where the arm is real nothing here waits: the newest
    state counts, and a button that is not held is a rest. In the simulator a step waits for the stick.

    Args:
        path: Device, such as ``/dev/input/js0``.
        button: Number of the button to hold; None for the simulator, where none is needed.
        guide_N: Force across the tool from which a person who pushes it leads it there; 0 for the stick.
        action_s: In the simulator steps follow each other no faster than this.
        sleep: Waits for so many seconds.

    Raises:
        ConfigurationError: The device cannot be opened.
    """

    def __init__(
        self,
        path: str,
        button: int | None,
        guide_N: float = 0.0,
        action_s: float = 0.1,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._path, self._button, self._guide_N = path, button, guide_N
        self._action_s, self._sleep = action_s, sleep
        self._axes: dict[int, float] = {}
        self._down: set[int] = set()
        self._torn = b""
        try:
            self._fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            accepted = f"a gamepad's device that can be read, such as /dev/input/js0 ({error.strerror})"
            raise ConfigurationError("gamepad", path, accepted) from error

    @override
    def __enter__(self) -> Self:
        return self

    @override
    def __exit__(self, *_: object) -> None:
        os.close(self._fd)

    @override
    def wait(self) -> None:
        """Until the button is pressed: one that was held all the while must be let go first."""
        if self._button is None:
            return
        while self.held and not self._ended:
            self._await()
        while not self.held and not self._ended:
            self._await()

    @property
    @override
    def held(self) -> bool:
        """Whether the button is held.

        Raises:
            DeviceError: The gamepad is gone.
        """
        self._take()
        return self._button is None or self._button in self._down

    @override
    def step(self, observation: Observation) -> int | None:
        if self._button is not None:
            if not self.held:
                return None
            x_N, y_N, _ = observation.force_N
            return compass_index(x_N, y_N, self._guide_N) if self._guide_N else self._pushed()
        self._sleep(self._action_s)
        self._take()
        while (way := self._pushed()) is None and not self._ended:
            self._await()
        return way

    def _pushed(self) -> int | None:
        """Where the stick leads, or the cross."""
        ways = (compass_index(-self._axes.get(y, 0.0), self._axes.get(x, 0.0), _LEAST) for x, y in _STICKS)
        return next((way for way in ways if way is not None), None)

    def _await(self) -> None:
        select.select([self._fd], [], [], _POLL_S)
        self._take()

    def _take(self) -> None:
        """Take in the events that came since."""
        try:
            for _ in range(_MOST_READS):
                if not (data := os.read(self._fd, 64 * _EVENT.size)):
                    raise DeviceError("gamepad", f"{self._path} is gone: plug it in again")
                self._torn += data
                whole = len(self._torn) - len(self._torn) % _EVENT.size
                for _, value, kind, number in _EVENT.iter_unpack(self._torn[:whole]):
                    self._note(kind & ~_INITIAL, number, value)
                self._torn = self._torn[whole:]
        except BlockingIOError:
            return
        except OSError as error:
            raise DeviceError("gamepad", f"{self._path} cannot be read ({error.strerror}): plug it in again") from error
        raise DeviceError("gamepad", f"{self._path} gives records without end: name a gamepad's device")

    def _note(self, kind: int, number: int, value: int) -> None:
        if kind == _AXIS:
            self._axes[number] = value / _FULL
        elif kind == _BUTTON and value:
            self._down.add(number)
        elif kind == _BUTTON:
            self._down.discard(number)
