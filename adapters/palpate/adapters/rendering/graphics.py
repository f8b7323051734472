"""Off-screen graphics: EGL where there is a driver for it, else OSMesa. Both do without display and graphics card."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any, Final

from palpate.core.errors import ConfigurationError, UsageError

LIBRARIES: Final = ("egl", "osmesa")
"""In the order in which they are tried."""
REMEDY: Final = "install libegl1 and libgl1-mesa-dri (EGL), or libosmesa6 (OSMesa), as Debian and Ubuntu name them"
_PLATFORM: Final = "PYOPENGL_PLATFORM"


def off_screen_context(width: int, height: int) -> Any:
    """An OpenGL context to draw in, made current; whoever takes it frees it.

    The environment variable MUJOCO_GL, ``egl`` or ``osmesa``, names the library to use.

    Args:
        width: Of the largest picture, in pixels.
        height: The same.

    Raises:
        UsageError: There is no graphics library that works.
        ConfigurationError: MUJOCO_GL names another one.
    """
    named = os.environ.get("MUJOCO_GL", "").lower()
    if named not in ("", *LIBRARIES):
        raise ConfigurationError("MUJOCO_GL", named, f"{' or '.join(LIBRARIES)} in the environment, or nothing")
    problems = []
    for library in (named,) if named else LIBRARIES:
        try:
            return _context(library, width, height)
        except Exception as error:
            # A library that is missing, one without a driver, one that refuses: each raises something of its own.
            problems.append(f"{library}: {_line(error)}")
            _forget_platform()
    raise UsageError(f"no graphics library can draw off screen ({'; '.join(problems)}); {REMEDY}")


def _context(library: str, width: int, height: int) -> Any:
    context = importlib.import_module(f"mujoco.{library}").GLContext(width, height)
    context.make_current()
    return context


def _forget_platform() -> None:
    """PyOpenGL settles for one library when it is first imported; without this the next could not be tried."""
    os.environ.pop(_PLATFORM, None)
    for name in [name for name in sys.modules if name.split(".")[0] == "OpenGL"]:
        del sys.modules[name]


def _line(error: Exception) -> str:
    return (" ".join(str(error).split()) or type(error).__name__)[:120]
