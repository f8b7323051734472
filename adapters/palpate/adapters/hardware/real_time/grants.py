"""What became of one request to the operating system."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Grant:
    """Granted or refused; a refusal is no error.

    Attributes:
        wish: What was asked for.
        granted: Whether the system gave it.
        reason: Why not; empty when granted.
        remedy: What would help; empty when granted.
    """

    wish: str
    granted: bool
    reason: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        if self.granted:
            return f"granted: {self.wish}"
        return f"refused: {self.wish}: {self.reason}; {self.remedy}"
