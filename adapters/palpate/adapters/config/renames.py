"""Settings that were called otherwise once: the one table of their old names."""

from collections.abc import Mapping
from typing import Final

RENAMED: Final[Mapping[str, tuple[str, ...]]] = {
    "supervision.max_sample_age_ms": ("supervision.max_force_age_ms", "supervision.max_joint_age_ms"),
}
"""Old dotted names, and what each is called now; two names where one setting became two.

In logs and run folders an old name is read; in a person's file and on a command line it is refused with the new one.
"""


def now_called(name: str) -> str:
    """What a setting of an old name is called now, for a message; empty if the name is no old one."""
    return " and ".join(RENAMED.get(name, ()))
