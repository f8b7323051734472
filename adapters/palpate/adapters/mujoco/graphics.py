"""Off-screen graphics: EGL if it has a driver, otherwise OSMesa. Neither needs a display or a graphics card."""

import importlib
import os
import subprocess
import sys
from typing import Any, Final

from palpate.core.errors import UsageError

GL_VARIABLE: Final = "PALPATE_GL"
"""Environment variable that the command line uses instead of MUJOCO_GL."""
LIBRARIES: Final = ("egl", "osmesa")
"""OpenGL backends, in the order in which they are tried."""
REMEDY: Final = "install libegl1 and libgl1-mesa-dri (EGL), or libosmesa6 (OSMesa), as Debian and Ubuntu name them"
_TIMEOUT_S: Final = 60.0


def off_screen_context(width: int, height: int) -> Any:
    """Create an OpenGL context for drawing, make it current, and return it. The caller must free it."""
    context = importlib.import_module(f"mujoco.{working_library()}").GLContext(width, height)
    context.make_current()
    return context


def working_library() -> str:
    """Return the OpenGL backend named in an environment variable, or otherwise the first that works."""
    named = (os.environ.get(GL_VARIABLE) or os.environ.get("MUJOCO_GL", "")).lower()
    problems = []
    # Other names are libraries that draw in windows.
    for library in (named,) if named in LIBRARIES else LIBRARIES:
        problem = problem_with(library)
        if not problem:
            return library
        problems.append(f"{library}: {problem}")
    raise UsageError(f"no graphics library can draw off screen ({'; '.join(problems)}); {REMEDY}")


def problem_with(library: str) -> str:
    """Return the reason why an OpenGL backend cannot draw, or an empty string if it can.

    The backend is tried in a separate process, because a process keeps the first backend that it loads, and a backend
    without a driver may end the process.
    """
    trial = f"from mujoco.{library} import GLContext; GLContext(8, 8).make_current()"
    environment = {**os.environ, "MUJOCO_GL": "off"}
    try:
        tried = subprocess.run(
            [sys.executable, "-c", trial],
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            env=environment,
            timeout=_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return "does not answer"
    if tried.returncode == 0:
        return ""
    return (tried.stderr.strip().splitlines() or [f"ended with {tried.returncode}"])[-1][:120]
