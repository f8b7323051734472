"""``palpate rig check``."""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import pytest

from palpate.adapters.cli.options import CheckOptions
from palpate.adapters.config import from_here, imported
from palpate.adapters.contracts import NO_MOTION, ArmCommandContract, ClockContract, DeviceContract, MotionLimits
from palpate.core.errors import ConfigurationError

_ACCEPTED: Final = "package.module:Name of a contract suite with its make(), such as a class from ForceSensorContract"
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
        code = pytest.main([str(tests), *flags, *shown])
    if isinstance(suite, ArmCommandContract) and not options.moves:
        sys.stdout.write("next: --moves --rate-rad-s RATE --reach-rad REACH tries the clauses that move the arm\n")
    return int(code != pytest.ExitCode.OK)


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
