"""Operator stop, triggered by a key press or by SIGUSR1. The arm stays stopped until the stop is acknowledged."""

import os
import select
import signal
import termios
import threading
import tty
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Any, Final, Self

from typing_extensions import override

from palpate.core.errors import ConfigurationError, FaultLatchedError, LifecycleError
from palpate.core.ports import AppliedCommand, ArmCommand, DeviceDecorator, JointCommand, Life

SIGNAL: Final = signal.SIGUSR1
_JOIN_S: Final = 1.0
_WAKE: Final = b"\0"


class OperatorStop:
    """The operator's stop, which stays latched until it is acknowledged.

    The context must be entered in the main thread, which receives the signal. While the main thread is busy in C code,
    the signal is delayed, but the arm process stops an arm that gets no set-points. The signal handler also stops the
    arm, and reports the cause once.
    """

    def __init__(
        self,
        arm: ArmCommand,
        *,
        keys: bool = True,
        notify: Callable[[str], None] = lambda trip: None,
        terminal_fd: int = 0,
    ) -> None:
        self._arm, self._keys, self._notify, self._fd = arm, keys, notify, terminal_fd
        self._tripped: list[str] = []
        self._opened: ExitStack | None = None

    @property
    def tripped(self) -> str:
        """Cause of the first stop since the last acknowledgement, or an empty string if there was no stop."""
        return next(iter(self._tripped), "")

    def stop(self, cause: str = "program: requested") -> None:
        """Stop the arm and latch the stop. This uses no lock, so any thread or signal handler may call it."""
        problem = stop_surely(self._arm)
        was_tripped = bool(self._tripped)
        self._tripped.append(cause + problem)
        if not was_tripped:
            with suppress(Exception):
                self._notify(cause + problem)

    def acknowledge(self) -> None:
        """Clear the trip. Only a person may decide to do this."""
        self._tripped.clear()

    def __enter__(self) -> Self:
        if self._opened is not None:
            raise LifecycleError("operator stop", "open", "open", "close it first")
        with ExitStack() as opened:
            if self._keys:
                self._watch_keys(opened)
            try:
                before: Any = signal.signal(SIGNAL, lambda *_: self.stop(f"signal: signal {SIGNAL.name}"))
            except ValueError as error:
                raise ConfigurationError(
                    "operator stop", SIGNAL.name, f"opened in the main thread ({error})"
                ) from error
            # None: a handler not installed by Python, which cannot be restored.
            opened.callback(signal.signal, SIGNAL, signal.SIG_DFL if before is None else before)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        opened, self._opened = self._opened, None
        if opened is not None:
            opened.close()

    def _watch_keys(self, opened: ExitStack) -> None:
        if not _is_ours(self._fd):
            return
        # Keys are read one by one, without Enter; Ctrl-C keeps its meaning.
        before = termios.tcgetattr(self._fd)
        tty.setcbreak(self._fd, termios.TCSANOW)
        # Released in reverse order: the thread before the resources that it uses.
        opened.callback(_restore, self._fd, before)
        wake, waker = os.pipe()
        for fd in (wake, waker):
            opened.callback(os.close, fd)
        thread = threading.Thread(target=self._run, args=(wake,), name="operator stop", daemon=True)
        thread.start()
        opened.callback(thread.join, _JOIN_S)
        opened.callback(os.write, waker, _WAKE)

    def _run(self, wake: int) -> None:
        while wake not in select.select([wake, self._fd], [], [])[0]:
            pressed = b""
            with suppress(OSError):
                pressed = os.read(self._fd, 64)
            self.stop("key: a key was pressed" if pressed else "key: the terminal is gone")
            if not pressed:
                # No more keys can be pressed.
                return


def _is_ours(fd: int) -> bool:
    """Return True if this process is in the terminal's foreground. Changing a terminal stops a background process."""
    if not os.isatty(fd):
        return False
    try:
        return os.tcgetpgrp(fd) == os.getpgrp()
    except OSError:
        # A terminal other than the controlling one, which has no background processes.
        return True


def _restore(fd: int, before: list[Any]) -> None:
    with suppress(termios.error):
        # A terminal that is gone need not be restored.
        termios.tcsetattr(fd, termios.TCSANOW, before)


class GuardedArm(DeviceDecorator, ArmCommand):
    """Arm that rejects activation and motion until the operator's stop is acknowledged."""

    def __init__(self, arm: ArmCommand, operator: OperatorStop) -> None:
        super().__init__(arm)
        self._arm, self._operator = arm, operator

    def activate(self) -> None:
        """Activate the arm, unless the operator has stopped it."""
        # The arm itself refuses an invalid request, with the reason.
        if self._operator.tripped and self._arm.life is Life.CONFIGURED:
            raise FaultLatchedError("arm", self._operator.tripped)
        super().activate()

    def send(self, command: JointCommand) -> AppliedCommand:
        """Send a command. While a stop is latched, the arm stays stopped, and the result says so."""
        if self._operator.tripped:
            # It may have been activated from elsewhere since it was stopped.
            stop_surely(self._arm)
        return self._arm.send(command)

    @override
    def stop(self) -> None:
        self._arm.stop()


def stop_surely(arm: ArmCommand) -> str:
    """Stop an arm that may be disconnected. Return the reason why it could not be commanded, or an empty string."""
    try:
        arm.stop()
    except Exception as error:
        # The contract forbids it, but a third-party arm may do it, and the latch must still be set.
        return f"; stop() failed: {error!r}"
    return ""
