"""Holds what the core reports of a replayed trial against what it reported when the trial was recorded."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from palpate.adapters.log import DecisionEntry, EndRecord, EventEntry, TrialLog, dump_json, end_of
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.adapters.replay.tape import Difference, Differences, close_enough, same_bits
from palpate.core.insertion import Purpose, TrialReport, generator
from palpate.core.policy import learner_of


def compare_start(differences: Differences, log: TrialLog, rebuilt: Rebuilt) -> None:
    """What the core derives by itself as a trial begins."""
    start, setup = log.start, rebuilt.setup
    state = dump_json(generator(setup.seed, Purpose.POLICY, setup.index).bit_generator.state)
    if state != start.generator_json:
        differences.add(Difference(0, "/start", "generator", start.generator_json, state), gross=True)
    temperature = rebuilt.task.report.temperature
    if temperature != start.temperature:
        difference = Difference(0, "/start", "temperature", start.temperature, temperature)
        gross = temperature is None or start.temperature is None or not close_enough(temperature, start.temperature)
        differences.add(difference, gross=gross)


def decisions_of(report: TrialReport) -> list[DecisionEntry]:
    """The decisions of a report as a log has them."""
    return [
        DecisionEntry(
            tick=d.tick,
            number=number,
            symbol=d.symbol,
            state=d.state,
            action=d.action,
            source=d.source,
            temperature=report.temperature,
        )
        for number, d in enumerate(report.decisions)
    ]


def compare_reports(
    differences: Differences, log: TrialLog, report: TrialReport, decisions: list[DecisionEntry]
) -> None:
    """Decisions, what they earned, events, and what the trial came to.

    A log that ends before its trial did may lack the last of them.
    """
    for recorded, replayed in zip(log.decisions, decisions, strict=False):
        _compare_fields(differences, "/decision", recorded.tick, recorded, replayed)
    whole = log.end is not None
    if len(decisions) > len(log.decisions) or (whole and len(decisions) < len(log.decisions)):
        few = min(len(decisions), len(log.decisions))
        tick = (decisions if len(decisions) > few else log.decisions)[few].tick
        count = Difference(tick, "/decision", "number of decisions", len(log.decisions), len(decisions))
        differences.add(count, gross=True)
    _compare_reinforcements(differences, log, report)
    events = [EventEntry(tick=e.tick, name=e.name, detail=e.detail) for e in report.events]
    for told, now in zip(log.events, events, strict=False):
        if (told.tick, told.name, told.detail) != (now.tick, now.name, now.detail):
            # Details hold rounded numbers, which another processor may round otherwise.
            gross = (told.tick, told.name) != (now.tick, now.name)
            shown = (f"{e.tick}: {e.name} {e.detail}".strip() for e in (told, now))
            differences.add(Difference(min(told.tick, now.tick), "/event", "event", *shown), gross=gross)
    if len(events) > len(log.events) or (whole and len(events) < len(log.events)):
        few = min(len(events), len(log.events))
        tick = (events if len(events) > few else log.events)[few].tick
        differences.add(Difference(tick, "/event", "number of events", len(log.events), len(events)), gross=True)
    if log.end is not None and not log.end.error:
        _compare_ends(differences, log.end, report)


def _compare_reinforcements(differences: Differences, log: TrialLog, report: TrialReport) -> None:
    known = [(n, d.reinforcement) for n, d in enumerate(report.decisions) if d.reinforcement is not None]
    ticks = [*(d.tick for d in report.decisions[1:]), report.ticks - 1]
    for recorded, (number, value) in zip(log.reinforcements, known, strict=False):
        for field, told, now in (
            ("number", recorded.number, number),
            ("tick", recorded.tick, ticks[number]),
            ("reinforcement", recorded.reinforcement, value),
        ):
            _compare_values(differences, "/reinforcement", recorded.tick, field, told, now)
    if len(known) > len(log.reinforcements) or (log.end is not None and len(known) < len(log.reinforcements)):
        count = Difference(
            report.ticks - 1, "/reinforcement", "number of reinforcements", len(log.reinforcements), len(known)
        )
        differences.add(count, gross=True)


def _compare_ends(differences: Differences, end: EndRecord, report: TrialReport) -> None:
    replayed = end_of(report)
    for name in ("outcome", "exploration_time_s", "actions", "peak_force_N", "depth_m", "ticks", "clamped_ticks"):
        _compare_values(differences, "/end", end.tick, name, getattr(end, name), getattr(replayed, name))


def compare_learners(differences: Differences, end: EndRecord, rebuilt: Rebuilt) -> None:
    """Hold the learner after the trial against the recorded one, number by number."""
    learner = learner_of(rebuilt.policy)
    now: Any = None if learner is None else learner.get_state()
    if now is not None and dump_json(now) == end.learner_json:
        return
    told: Any = json.loads(end.learner_json) if end.learner_json else None
    _compare_trees(differences, end.tick, "learner", told, now)


def _compare_trees(differences: Differences, tick: int, where: str, told: Any, now: Any) -> None:
    if isinstance(told, dict) and isinstance(now, dict) and told.keys() == now.keys():
        for key in told:
            _compare_trees(differences, tick, f"{where}.{key}", told[key], now[key])
    elif isinstance(told, list) and isinstance(now, list) and len(told) == len(now):
        for index, (a, b) in enumerate(zip(told, now, strict=True)):
            _compare_trees(differences, tick, f"{where}[{index}]", a, b)
    else:
        _compare_values(differences, "/end", tick, where, told, now)


def _compare_fields(differences: Differences, channel: str, tick: int, recorded: Any, replayed: Any) -> None:
    for field in fields(recorded):
        if field.name == "counterfactual":
            # How the log came about, not what the core said.
            continue
        told, now = getattr(recorded, field.name), getattr(replayed, field.name)
        _compare_values(differences, channel, tick, field.name, told, now)


def _compare_values(differences: Differences, channel: str, tick: int, field: str, told: Any, now: Any) -> None:
    if isinstance(told, float) and isinstance(now, float):
        if not same_bits((told,), (now,)):
            difference = Difference(tick, channel, field, told, now)
            differences.add(difference, gross=not close_enough(told, now))
    elif told != now:
        differences.add(Difference(tick, channel, field, told, now), gross=True)
