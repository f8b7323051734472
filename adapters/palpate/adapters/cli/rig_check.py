"""``palpate rig check``."""

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import pytest

from palpate.adapters.cli.options import CheckOptions
from palpate.adapters.config import from_here, imported
from palpate.adapters.contracts import NO_MOTION, ArmCommandContract, ClockContract, DeviceContract, MotionLimits
from palpate.core.errors import ConfigurationError

_ACCEPTED: Final = "package.module:Name of a contract suite with its make(), such as a class from ForceSensorContract"
_PATIENCE_S: Final = 60.0
"""How long a clause may take on an arm that does not move."""
_MODULE: Final = """
from {module} import {name}
from palpate.adapters.contracts import MotionLimits

class Test{name}({name}):
    motion = {motion}
"""


def check(options: CheckOptions) -> int:
    """Run the clauses of the suite as pytest does; 0 if all that apply are kept, else 1."""
    motion = MotionLimits(options.rate_rad_s, options.reach_rad) if options.moves else NO_MOTION
    # As with python -m, modules in the current folder can be named.
    with from_here(), TemporaryDirectory() as folder:
        suite = _suite(options.suite)
        if isinstance(suite, ArmCommandContract):
            _print_plan(suite, motion)
        module, _, name = options.suite.partition(":")
        tests = Path(folder) / "test_contract.py"
        tests.write_text(_MODULE.format(module=module, name=name, motion=motion), encoding="utf-8")
        # Without settings of the current folder.
        flags = ("-c", os.devnull, f"--rootdir={folder}", "-p", "no:cacheprovider", "--import-mode=importlib")
        shown = ("--capture=no", "--verbose", "--no-header", "--tb=line", "-rs", "--disable-warnings")
        code = pytest.main([str(tests), *flags, *shown], plugins=[Patience(_patience_s(motion))])
    if isinstance(suite, ArmCommandContract) and not options.moves:
        sys.stdout.write("next: --moves --rate-rad-s RATE --reach-rad REACH tries the clauses that move the arm\n")
    return int(code != pytest.ExitCode.OK)


class _OverdueError(BaseException):
    """A clause takes too long; no adapter catches it on its way out."""


class Patience:
    """Gives a clause up that takes longer than ``seconds``, and tries none after it."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Run a clause."""

        # In place and by a signal: on the way out the rig's arm is stopped and closed. Each second again.
        def interrupt(*_: object) -> None:
            item.session.shouldstop = "no clause after it was tried"
            raise _OverdueError(f"it was not done after {self._seconds:g} s, something blocks")

        handler = signal.signal(signal.SIGALRM, interrupt)
        others = signal.setitimer(signal.ITIMER_REAL, self._seconds, 1.0)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, *others)
            signal.signal(signal.SIGALRM, handler)


def _suite(name: str) -> DeviceContract[Any] | ClockContract:
    found = imported("suite", name, _ACCEPTED)
    if not isinstance(found, type) or not issubclass(found, (DeviceContract, ClockContract)):
        raise ConfigurationError("suite", name, _ACCEPTED)
    try:
        return found()
    except Exception as error:
        raise ConfigurationError("suite", name, f"{_ACCEPTED}; calling it failed: {error!r}") from error


def _print_plan(suite: ArmCommandContract, motion: MotionLimits) -> None:
    rig = suite.make().within(motion)
    plan = suite.plan(rig)
    rig.dispose()
    sys.stdout.write("what will move:\n" + "".join(f"  {line}\n" for line in plan))
    sys.stdout.flush()


def _patience_s(motion: MotionLimits) -> float:
    """How long a clause may take: those that move go to many limits, and home before and after each."""
    rate, reach = motion.rate_rad_s, motion.reach_rad
    return _PATIENCE_S if not rate else 5.0 * _PATIENCE_S + 50.0 * reach / rate
