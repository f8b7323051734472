"""What a trial taught: a link in the chain of a learning, held against the trials before and after."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from palpate.adapters.log import TrialLog, learner_of_json


@dataclass(frozen=True)
class Lesson:
    """What a trial taught, to be held against the trials before and after."""

    run: str
    trial: int
    before: str
    after: str
    perception: Any = None


def lesson_of(log: TrialLog, kept: str) -> Lesson | None:
    """What a trial taught; None where nothing is learned, or the log does not hold it.

    Args:
        kept: State of the learner, JSON, with which the training goes on.
    """
    start, end = learner_of_json(log.start.learner_json), log.end
    if start is None or log.start.frozen or log.start.derived_from or end is None or not end.learner_json:
        return None
    after = learner_of_json(kept)
    common = (log.start.config_toml, log.start.perception_json, log.start.policy_json)
    run = hashlib.sha256(repr(common).encode()).hexdigest()
    if after is None:
        return None
    perception = json.loads(log.start.perception_json)
    return Lesson(run, log.start.trial, values_digest(start), values_digest(after), perception)


def values_digest(learner: Mapping[str, Any]) -> str:
    """Digest of what a learner has learned, to the last bit.

    That is values and visits, of states and of symbols; the trials of a belief; or whatever a foreign learner has.
    """
    names: tuple[str, ...] = ("q", "visits", "symbol_q", "symbol_visits")
    for others in (("trials", "trials_learned"), ("state", "trials_learned")):
        names = others if others[0] in learner else names
    return hashlib.sha256(json.dumps([learner.get(name) for name in names]).encode()).hexdigest()
