"""Claims about a policy's success, such as ``success >= 0.99``, and the verdict of trials on them."""

from __future__ import annotations

import re
from dataclasses import dataclass

from palpate.adapters.experiments.statistics import exact_interval
from palpate.core.errors import ConfigurationError


@dataclass(frozen=True)
class Claim:
    """A lower bound of the share of successful trials."""

    share: float

    @classmethod
    def parse(cls, text: str) -> Claim:
        """Read a claim.

        Raises:
            ConfigurationError: The text is not ``success >= SHARE`` with a share between 0 and 1.
        """
        found = re.fullmatch(r"\s*success\s*>=\s*(0?\.\d+)\s*", text)
        share = float(found.group(1)) if found else 0.0
        if not 0.0 < share < 1.0:
            raise ConfigurationError("claim", text, "success >= SHARE with a share between 0 and 1: success >= 0.99")
        return cls(share)

    def verdict(self, successes: int, trials: int) -> str:
        """Compare the exact 95 % interval of the share of successes with the claim."""
        low, high = exact_interval(successes, trials)
        if low >= self.share:
            return "proved"
        return "refuted" if high < self.share else "inconclusive"

    def __str__(self) -> str:
        return f"success >= {self.share:g}"
