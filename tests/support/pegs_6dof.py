"""Insertions in six degrees of freedom as tests and benchmarks run them, with drawn poses of hole, plate and grip."""

from palpate.adapters.config import compose, overlay
from palpate.adapters.experiments import ChosenPolicy, Run
from palpate.core.errors import DeviceError
from palpate.core.job import SIDES

TASK = "insertion-6dof"
FIRST = 500_000
SHAPES = ("round", *SIDES)
CONDITIONS = {
    "asked": {},
    "friction": {"cell": {"peg": {"friction": 0.4}}},
    "tight": {"part": {"hole_mm": 29.08}},
    "tightest": {"part": {"hole_mm": 29.04}},
    "yaw-10": {"place": {"yaw_uncertainty_deg": 10.0}},
}


def config_of(shape, conditions, arm, options):
    """Compose the job of a shape: a round peg in a tilted grip, others in a hole that is turned, too."""
    name = "paper" if shape == "round" else f"blind-{shape}"
    own = {"place": {"tilt_uncertainty_mrad": 4.0}} if shape == "round" else {}
    more = {"arm": arm, "task": {"options": dict(options)}}
    return compose(name, "q-learning", own, CONDITIONS[conditions], more, task=TASK)


def trials(config, policy, seed, numbers):
    """Trial, outcome, success, time, true peak force, actions, last event; a trip ends one trial and no more."""
    config = overlay(config, {"seed": seed})
    rows = []
    with Run(config) as run:
        work = run.trials(ChosenPolicy(policy, config))
        for number in numbers:
            try:
                scored = work.run(FIRST + number)
            except DeviceError as error:
                rows.append((number, "error", False, 0.0, 0.0, 0, str(error)))
                continue
            report = scored.report
            outcome = "none" if report.outcome is None else report.outcome.value
            force = 0.0 if scored.truth is None else scored.truth.peak_force_N
            rows.append((
                number, outcome, scored.success, report.exploration_time_s, force, report.actions,
                report.events[-1].detail,
            ))  # fmt: skip
    return rows
