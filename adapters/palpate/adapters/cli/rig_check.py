"""The ``palpate rig check`` command."""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import pytest

from palpate.adapters.cli.options import CheckOptions
from palpate.adapters.config import from_here, imported
from palpate.adapters.contracts import ArmCommandContract, ClockContract, DeviceContract, JointEncoderContract
from palpate.core.errors import ConfigurationError

_ACCEPTED: Final = "package.module:Name of a contract suite with its make(), such as a class from ForceSensorContract"
_MODULE: Final = """
from {module} import {name}

class Test{name}({name}):
    may_command = {may_command}
"""


def check(options: CheckOptions) -> int:
    """Run the suite's clauses with pytest; return 0 if all applicable clauses hold, else 1."""
    # As with python -m, modules in the current folder can be imported.
    with from_here(), TemporaryDirectory() as folder:
        suite = _suite(options.suite)
        module, _, name = options.suite.partition(":")
        tests = Path(folder) / "test_contract.py"
        text = _MODULE.format(module=module, name=name, may_command=options.moves)
        tests.write_text(text, encoding="utf-8")
        # Ignores pytest settings in the current folder.
        flags = ("-c", os.devnull, f"--rootdir={folder}", "-p", "no:cacheprovider", "--import-mode=importlib")
        shown = ("--capture=no", "--verbose", "--no-header", "--tb=line", "-rs", "--disable-warnings")
        code = pytest.main([str(tests), *flags, *shown])
    if isinstance(suite, (ArmCommandContract, JointEncoderContract)) and not options.moves:
        sys.stdout.write("clauses that move the arm were skipped; --moves tries them on a simulated arm\n")
    return int(code != pytest.ExitCode.OK)


def _suite(name: str) -> DeviceContract[Any] | ClockContract:
    found = imported("suite", name, _ACCEPTED)
    if not isinstance(found, type) or not issubclass(found, (DeviceContract, ClockContract)):
        raise ConfigurationError("suite", name, _ACCEPTED)
    try:
        return found()
    except Exception as error:
        raise ConfigurationError("suite", name, f"{_ACCEPTED}; calling it failed: {error!r}") from error
