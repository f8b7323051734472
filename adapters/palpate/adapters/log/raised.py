"""Who raised the error that ended a trial: what the core raised itself, a replay of the trial has to raise again."""

import traceback
from typing import Final

from palpate.core.errors import PalpateError, PolicyError

BY_CORE: Final = "core"
BY_PORT: Final = "port"
BY_POLICY: Final = "policy"
"""A policy that is not palpate's own: its fault, and no replay without its code can raise that again."""
BY_OUTSIDE: Final = "outside"
"""An observer, the clock, a signal: whatever is neither the core nor a device."""
_CORE, _PORTS, _LOOP = "palpate.core.", "palpate.core.ports", "palpate.core.control_loop"


def raised_by(error: BaseException, failed_port: str = "") -> str:
    """Who raised it: :data:`BY_CORE`, :data:`BY_PORT`, :data:`BY_POLICY` or :data:`BY_OUTSIDE`.

    Args:
        error: As it was caught outside of the control loop.
        failed_port: The port whose call failed; empty for none.
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
    # What the loop had called. Ports and observers may be built on the core's own classes of devices.
    below = [name for name in names[names.index(_LOOP) :] if name != _LOOP]
    if below and (not below[0].startswith(_CORE) or below[0].startswith(_PORTS)):
        return BY_OUTSIDE
    # A handler of a signal runs wherever the core is.
    others = [name for name in below if name.startswith("palpate.") and not name.startswith(_CORE)]
    return BY_OUTSIDE if others else BY_CORE
