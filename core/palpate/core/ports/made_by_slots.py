"""Frozen dataclasses that are made by the thousand: their fields set by the slots themselves.

What dataclasses generate sets each field by ``object.__setattr__``, which looks the slot up by its name: that is two
thirds of the time that a sample takes to make.
"""

from dataclasses import fields
from functools import wraps
from typing import Any, TypeVar

_ClassT = TypeVar("_ClassT")


def made_by_slots(frozen: type[_ClassT]) -> type[_ClassT]:
    """Let a class, ``@dataclass(frozen=True, slots=True)``, be made in half the time; all else stays as it is.

    Args:
        frozen: Its fields are all given by position or name, and no default is made by a factory.
    """
    plain: Any = frozen.__init__
    names = [field.name for field in fields(frozen)]  # type: ignore[arg-type]
    slots: dict[str, Any] = {f"set_{name}": getattr(frozen, name).__set__ for name in names}
    lines = [f"set_{name}(self, {name})" for name in names]
    lines += ["self.__post_init__()"] if hasattr(frozen, "__post_init__") else []
    exec("\n    ".join((f"def __init__(self, {', '.join(names)}):", *lines)), slots)
    made: Any = wraps(plain)(slots["__init__"])
    made.__defaults__ = plain.__defaults__
    frozen.__init__ = made  # type: ignore[method-assign]
    return frozen
