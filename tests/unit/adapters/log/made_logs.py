"""Small logs made for a test: everything in them is said by the test itself."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from palpate.adapters.config import scenario, to_toml
from palpate.adapters.log import (
    CallEntry,
    DecisionEntry,
    EndRecord,
    EventEntry,
    LossEntry,
    ReinforcementEntry,
    TickRecord,
)
from palpate.adapters.log.container import RawMessage
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.records import StartRecord
from palpate.adapters.log.schema import BY_TOPIC, SCHEMA
from palpate.core.ports import AppliedCommand, JointSample, WrenchSample
from tests.support import log_surgery

PERIOD_NS = 1_000_000_000 // 140
POSTURE = (0.0, 1.0752755, -1.4561609, 0.0, 0.6101755, 0.0)
"""The zebra-zero above its goal."""


def start(**changes: Any) -> StartRecord:
    """What a trial of the paper's scenario starts with."""
    record = StartRecord(
        schema=SCHEMA, command="train", config_toml=to_toml(scenario("paper")), arm="zebra-zero", model_sha256="",
        core_sha256="", seed=7, trial=3, start_m=(0.001, 0.0), ready_rad=POSTURE,
        tip_rotation=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), perception_json="{}",
        policy="document", world="simulator", versions_json='{"palpate":"0.1.0"}',
    )  # fmt: skip
    return replace(record, **changes)


def tick(number: int, **changes: Any) -> TickRecord:
    """A whole tick; the numbers in it tell its own number."""
    now = number * PERIOD_NS
    record = TickRecord(
        tick=number,
        time_ns=now,
        deadline_ns=now,
        wrench=WrenchSample((0.1 * number, -1.0, 3.0), (0.01, 0.02, 0.03), now - 2_000_000, now, number),
        joints=JointSample(tuple(q + 1e-4 * number for q in POSTURE), now, now, number),
        asked_rad=POSTURE,
        applied=AppliedCommand(POSTURE),
    )
    return replace(record, **changes)


def write_log(
    path: Path,
    ticks: Sequence[TickRecord],
    *,
    begin: StartRecord | None = None,
    others: Sequence[CallEntry | DecisionEntry | ReinforcementEntry | EventEntry | LossEntry] = (),
    end: EndRecord | None = None,
) -> Path:
    """A sound log with these messages; those besides the ticks come when their tick does."""
    kinds = {
        DecisionEntry: "Decision", ReinforcementEntry: "Reinforcement", EventEntry: "Event", LossEntry: "Recorder",
    }  # fmt: skip
    messages: list[RawMessage] = []

    def add(topic: str, at: int, payload: bytes) -> None:
        messages.append(RawMessage(BY_TOPIC[topic].id, max(at, 0) * PERIOD_NS, payload))

    add("/start", 0, encode_record("Start", begin or start()))
    left = sorted(others, key=lambda entry: entry.tick)
    for record in ticks:
        add("/tick", record.tick, encode_record("Tick", record))
        while left and left[0].tick <= record.tick:
            entry = left.pop(0)
            if isinstance(entry, CallEntry):
                add("/call", record.tick, encode_record("Call", entry))
            else:
                name = kinds[type(entry)]
                add(f"/{name.lower()}", record.tick, encode_record(name, entry))
    if end is not None:
        add("/end", ticks[-1].tick if ticks else 0, encode_record("End", end))
    return log_surgery.write_log(path, messages)
