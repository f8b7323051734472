"""One cell of a study: settings, a policy and a seed, and the name of the folder that its run is kept in."""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

CELL_FILE: Final = "cell.json"
FORMAT: Final = 1
LEARN: Final = "q-learning"
"""The policy where none is named; learners are trained, every other policy runs as it is."""
_LONGEST: Final = 80


@dataclass(frozen=True)
class StudyCell:
    """What distinguishes one run of a study from the others.

    Attributes:
        policy: A learner's name, a comparator's name or a policy file.
    """

    fields: Mapping[str, Any]
    policy: str
    seed: int

    @cached_property
    def name(self) -> str:
        """Name of its folder. It depends on the cell alone, so a study that grows renames nothing."""
        facts = {"fields": self.fields, "policy": self.policy, "seed": self.seed}
        text = json.dumps(facts, sort_keys=True, ensure_ascii=False)
        digest = hashlib.sha256(text.encode("utf-8")).hexdigest()[:10]
        policy = self.policy
        if policy.endswith(".json"):
            policy = Path(policy).parent.name or Path(policy).stem
        words = [
            policy,
            *(f"{field.rsplit('.', 1)[-1]}-{_word(value)}" for field, value in sorted(self.fields.items())),
        ]
        readable = re.sub(r"[^A-Za-z0-9.+-]+", "_", "-".join(words))[:_LONGEST].strip("._-")
        return f"{readable}-seed-{self.seed:03d}-{digest}"

    def __str__(self) -> str:
        settings = "".join(f"{field} = {_word(value)}, " for field, value in self.fields.items())
        return f"{settings}{self.policy}, seed {self.seed}"

    def document(self) -> dict[str, Any]:
        """The content of ``cell.json``."""
        return {
            "fields": dict(sorted(self.fields.items())),
            "policy": self.policy,
            "seed": self.seed,
            "format": FORMAT,
        }


def _word(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
