"""Compose a run's configuration from presets, a job, files and flags."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeAlias

from palpate.adapters.config.learning import learner_in
from palpate.adapters.config.rig import RigFile
from palpate.adapters.config.run import RunConfig
from palpate.adapters.config.scenarios import BLIND, JOB, LEARNERS, SCENARIOS
from palpate.adapters.config.tasks import INSERTION, task_kind
from palpate.adapters.config.toml import merged, overlay, read_toml, run_facts
from palpate.core.errors import ConfigurationError, did_you_mean, require_one_of
from palpate.core.job import JOB_TABLES, STATED, Job, PlaceConfig, Verdict, derived_settings, judge
from palpate.core.motion import arm_named, arm_of_table
from palpate.core.ports import SensorFacts
from palpate.core.trial import Purpose, generator
from palpate.simulation.work_cell import CellConfig

Tables: TypeAlias = Mapping[str, Any] | str | os.PathLike[str] | None
"""Nested tables of settings, the path to a TOML file with such tables, or None."""
_OF_A_JOB: Final = (*JOB_TABLES, "arm", "cell")
_EXAMPLES: Final = "there are examples in examples/jobs, such as dowel-12-h7.toml"


def read_job(source: str | os.PathLike[str] | Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables in a job, which is given as a file or as tables.

    Raises:
        ConfigurationError: The job cannot be read, has unknown tables, or lacks required fields.
    """
    if not isinstance(source, Mapping) and not os.path.exists(source):
        raise ConfigurationError("job", str(source), f"no such file; {_EXAMPLES}")
    table = dict(source) if isinstance(source, Mapping) else read_toml(Path(source), "job")
    for name, value in table.items():
        if name not in _OF_A_JOB:
            near = did_you_mean(name, _OF_A_JOB)
            accepted = f"one of the tables {', '.join(_OF_A_JOB)}{near}; other settings belong in --config"
            raise ConfigurationError(name, value, f"{accepted}, in a job")
        if name != "arm" and not isinstance(value, Mapping):
            raise ConfigurationError(name, value, "a table")
    for name, fields in STATED.items():
        given = table.get(name, {})
        missing = [f"{name}.{field}" for field in fields if field not in given]
        if missing:
            where = list(source) if isinstance(source, Mapping) else str(source)
            raise ConfigurationError("job", where, f"no {', '.join(missing)}, which a job must state")
    return table


def compose(
    name: str = "paper",
    learner: str = "q-learning",
    *tables: Mapping[str, Any],
    task: str = INSERTION,
    job: Mapping[str, Any] | None = None,
    sensor: SensorFacts | None = None,
) -> RunConfig:
    """Compose a configuration. Later layers override earlier ones.

    The layers are derived settings, presets for the learner, scenario and task, the job, and the tables in order.
    Settings are derived from the job's tables after all layers are merged.

    Args:
        name: Scenario; ``job`` for a job without a scenario.
        sensor: Noise of a rig's force sensor; by default, the simulated sensor's noise.

    Raises:
        ConfigurationError: A preset or a field is unknown, or a value is rejected.
    """
    require_one_of("scenario", name, tuple(SCENARIOS))
    require_one_of("learner", learner, tuple(LEARNERS))
    if name == JOB and job is None and not any("part" in table for table in tables):
        raise ConfigurationError("scenario", name, f"given with --job FILE, or another one chosen; {_EXAMPLES}")
    chosen: dict[str, Any] = {"scenario": name, "learner": learner}
    preset = {} if task == INSERTION else {**task_kind(task).preset}
    if task != INSERTION:
        chosen["task"] = {"name": task}
    blind = {} if name in ("paper", JOB) else BLIND
    layers = [LEARNERS[learner], blind, SCENARIOS[name], preset, job or {}, *tables]
    stated = merged(*layers, chosen)
    if isinstance(arm := stated.get("arm"), Mapping):
        stated["arm"] = arm_of_table(arm)
    base = RunConfig() if job is None else RunConfig(place=PlaceConfig())
    known = overlay(base, {key: stated[key] for key in JOB_TABLES if key in stated})
    if sensor is None:
        noise = overlay(base.cell.sensor, _table(_table(stated, "cell"), "cell.sensor"))
        sensor = simulated_noise(replace(base, cell=replace(base.cell, sensor=noise)))
    derived = derived_settings(job_of(known), sensor, task)
    return overlay(base, merged(derived, stated))


def configured(
    job: Tables = None,
    *,
    rig: str = "",
    scenario: str = "",
    learner: str = "",
    policy: str = "",
    task: str = "",
    arm: str = "",
    settings: Tables = None,
    flags: Mapping[str, Any] | None = None,
    measured: bool = True,
) -> RunConfig:
    """Compose a configuration from files, presets and tables, as the command line does.

    Args:
        job: Job file, or its tables; None uses the rig's job, or else the paper's.
        rig: Rig file that provides the arm, noise and measurements; if empty, the simulator is used.
        scenario: Preset; by default, the one in the settings, or else ``job`` if there is a job, or else ``paper``.
        learner: Learner; by default, the one in the settings, or else in the policy file, or else Q-learning.
        policy: Policy; only a policy file affects the configuration.
        task: Task; by default, the one in the settings, or else insertion.
        arm: Name of the arm; by default, the arm in the settings, the job or the rig.
        settings: A table such as ``{"task": {"step_mm": 0.5}}``, or a TOML file with settings, such as a ``run.toml``.
        flags: Tables of settings that override all others.
        measured: Whether measurements made on the rig replace values in the job.

    Raises:
        ConfigurationError: A setting is unknown or rejected, a file cannot be read, or a rig has no job.
    """
    table = tables_of(settings)
    # The [run] table of a run.toml does not contain settings.
    run_facts(table, str(settings))
    file = RigFile.load(Path(rig)) if rig else None
    job = job or (file.job if file is not None and not table else None)
    stated = read_job(job) if job else None
    name = _agreed("scenario", scenario, table) or ("paper" if stated is None else JOB)
    task = _agreed("name", task, _table(merged(table, flags or {}), "task"), "task.") or INSERTION
    learner = _agreed("learner", learner, table) or learner_in(policy) or "q-learning"
    own: dict[str, Any] = {"arm": arm} if arm else {}
    noise = None
    if file is not None:
        (table, stated), own, noise = file.laid_over(table, stated, arm, measured=measured), {}, file.facts.noise()
    layers = {**table, "scenario": name, "learner": learner}, own, flags or {}
    return compose(name, learner, *layers, task=task, job=stated, sensor=noise)


def _agreed(key: str, chosen: str, table: Mapping[str, Any], before: str = "") -> str:
    """Return the name of a preset, or an empty string if neither the caller nor the settings name one."""
    written = table.get(key, "")
    if not isinstance(written, str):
        raise ConfigurationError(f"{before}{key}", written, "a name")
    if chosen and written not in ("", chosen):
        # The settings would replace all values from the other preset.
        raise ConfigurationError(f"{before}{key}", chosen, f"{written!r}, as in the settings, or others without {key}")
    return chosen or written


def tables_of(settings: Tables) -> dict[str, Any]:
    """Return the tables of settings, which may be given as tables, as a TOML file, or not at all.

    Raises:
        ConfigurationError: The settings have a different type.
    """
    if settings is None:
        return {}
    if isinstance(settings, Mapping):
        return dict(settings)
    if isinstance(settings, (str, os.PathLike)):
        return read_toml(Path(settings))
    raise ConfigurationError("config", settings, "a table of settings, the name of a TOML file, or None")


def scenario(name: str, learner: str = "q-learning") -> RunConfig:
    """Return the configuration for a scenario and a learner.

    Raises:
        ConfigurationError: The scenario or the learner is unknown.
    """
    return compose(name, learner)


def remeasured(config: RunConfig, measured: Mapping[str, Any], sensor: SensorFacts | None) -> RunConfig:
    """Return a copy with new job values and with the settings derived from them and from the sensor noise."""
    noise, task = sensor or simulated_noise(config), config.task.name
    other = overlay(config, measured)
    before, after = (derived_settings(job_of(each), noise, task) for each in (config, other))
    return overlay(other, _changed(other, before, after))


def of_trial(config: RunConfig, trial: int, *, drawn: bool) -> RunConfig:
    """Return the configuration for one trial, with that trial's place and force limit.

    Args:
        drawn: Whether to draw a force limit for the trial if the job specifies a range.
    """
    place, limits, measured = config.place, config.limits, dict[str, Any]()
    if place.further_mm:
        x, y, z = place.centres_mm[trial % len(place.centres_mm)]
        measured["place"] = {"x_mm": x, "y_mm": y, "z_mm": z, "further_mm": ()}
    if limits.drawn_from_N and drawn:
        force_N = generator(config.seed, Purpose.LIMIT, trial).uniform(limits.drawn_from_N, limits.force_N)
        measured["limits"] = {"force_N": round(force_N, 2), "drawn_from_N": 0.0}
    # A learner keeps the settings with which it was created.
    return replace(remeasured(config, measured, None), learning=config.learning) if measured else config


def _changed(config: Any, before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return the derived settings that changed, except those that the user has set."""
    result: dict[str, Any] = {}
    for key, value in after.items():
        held = config.get(key) if isinstance(config, Mapping) else getattr(config, key)
        if isinstance(value, Mapping):
            result[key] = _changed(held, before[key], value)
        elif value != before[key] and held == before[key]:
            result[key] = value
    return result


def job_of(config: RunConfig) -> Job:
    """Return the job in a configuration."""
    return Job(config.part, config.tool, config.place, config.limits)


def simulated_noise(config: RunConfig) -> SensorFacts:
    """Return the simulated force sensor's noise."""
    sensor = config.cell.sensor
    return SensorFacts(sensor.force_noise_N, sensor.torque_noise_Nm)


def depth_step_mm(config: RunConfig) -> float:
    """Return the standard deviation of the tip position along the tool axis due to encoder resolution."""
    # Loading the kinematics is slow, and help and logs do not need them.
    from palpate.core.motion import Kinematics

    return Kinematics(arm_named(config.arm), config.tool.geometry).depth_step_m() * 1e3


def verdict_on(config: RunConfig, task: str = "") -> Verdict:
    """Return the verdict on a configuration's job, using the simulated noise, for a given task or for the best one."""
    return judge(job_of(config), simulated_noise(config), step_mm=depth_step_mm(config), task=task)


def without_world(config: RunConfig) -> RunConfig:
    """Return the configuration with the simulated cell derived from its job alone."""
    tables = derived_settings(job_of(config), SensorFacts(0.1, 0.004), config.task.name)
    return replace(config, cell=overlay(CellConfig(), tables["cell"]))


def _table(tables: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = tables.get(name.rpartition(".")[2], {})
    if not isinstance(value, Mapping):
        raise ConfigurationError(name, value, "a table")
    return value
