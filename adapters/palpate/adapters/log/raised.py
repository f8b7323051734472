"""Origin of the error that ended a trial. An error from the core must occur again in a replay."""

import traceback
from typing import Final

from palpate.core.errors import PalpateError, PolicyError

BY_CORE: Final = "core"
BY_PORT: Final = "port"
BY_POLICY: Final = "policy"
"""A third-party policy raised the error. A replay without its code cannot reproduce it."""
BY_OUTSIDE: Final = "outside"
"""An observer, the clock or a signal caused the error, not the core or a device."""
_CORE, _PORTS, _LOOP = "palpate.core.", "palpate.core.ports", "palpate.core.control_loop"


def raised_by(error: BaseException, failed_port: str = "") -> str:
    """Return the origin of the error: :data:`BY_CORE`, :data:`BY_PORT`, :data:`BY_POLICY` or :data:`BY_OUTSIDE`.

    Args:
        error: The error as caught outside the control loop.
        failed_port: The port whose call failed; empty if none did.
    """
    if isinstance(error, PolicyError):
        return BY_POLICY
    if not isinstance(error, PalpateError):
        return BY_OUTSIDE
    if failed_port:
        return BY_PORT
    names = [str(frame.f_globals.get("__name__", "")) for frame, _ in traceback.walk_tb(error.__traceback__)]
    if _LOOP not in names:
        return BY_OUTSIDE
    # The functions called by the loop. Ports and observers may use the core's device classes.
    below = [name for name in names[names.index(_LOOP) :] if name != _LOOP]
    if below and (not below[0].startswith(_CORE) or below[0].startswith(_PORTS)):
        return BY_OUTSIDE
    # A signal handler may run inside the core.
    others = [name for name in below if name.startswith("palpate.") and not name.startswith(_CORE)]
    return BY_OUTSIDE if others else BY_CORE
