"""What ``benchmarks.tick_walk`` walks through: one trial of a checkout, composed of that checkout's own parts.

The one place that knows where things are: a layout's table says which module has which name, or which one stands for
it there. Whoever moves something for good adds a layout, told by a file that older ones lack; ways between only need
the newest one changed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import Any, TypeAlias

from benchmarks.checkouts import import_path
from benchmarks.emulated_rig import EmulatedRig, words_of

Trial: TypeAlias = Callable[[], object]


@dataclass(frozen=True)
class Layout:
    """Where a checkout keeps what is needed here.

    Attributes:
        sign: A file that tells it from older layouts.
        modules: The module of each name; with a colon and a name behind it where the checkout calls it otherwise.
        ready_from: What of a configuration the ready pose is found from.
    """

    sign: str
    modules: dict[str, str]
    ready_from: Callable[[Any], tuple[Any, ...]]


FOLDED = Layout(
    "core/palpate/core/control_loop.py",
    {
        "GuardedArm": "palpate.adapters.hardware.watchdogs",
        "Ports": "palpate.core.ports.devices",
        "RealTimeSession": "palpate.adapters.hardware.real_time.session",
        "SimulatedRig": "palpate.adapters.mujoco.rig",
        "Stopwatch": "palpate.adapters.hardware.real_time",
        "TrialRecorder": "palpate.adapters.log.trial_recorder",
        "WatchedArm": "palpate.adapters.hardware.watchdogs",
        "WatchedClock": "palpate.adapters.hardware.watchdogs",
        "WatchedForceSensor": "palpate.adapters.hardware.watchdogs",
        "WatchedJointEncoder": "palpate.adapters.hardware.watchdogs",
        "build_perception": "palpate.adapters.experiments.build",
        "build_supervisor": "palpate.adapters.experiments.build",
        "build_task": "palpate.adapters.experiments.build",
        "comparator": "palpate.adapters.experiments.policies",
        "find_ready_pose": "palpate.core.insertion.ready_pose",
        "main": "palpate.adapters.cli.main",
        "run_scored_trial": "palpate.adapters.experiments.trial",
        "scenario": "palpate.adapters.config.run",
    },
    lambda config: (config.arm, config.task),
)
BEFORE = Layout(
    "core/palpate/core/cycle.py",
    {
        "GuardedArm": "palpate.adapters.watchdogs",
        "Ports": "palpate.core.cycle",
        "RealTimeSession": "palpate.adapters.beat:Beat",
        "SimulatedRig": "palpate.adapters.composition",
        "Stopwatch": "palpate.adapters.timing",
        "TrialRecorder": "palpate.adapters.recording.trials",
        "WatchedArm": "palpate.adapters.watchdogs",
        "WatchedClock": "palpate.adapters.watchdogs",
        "WatchedForceSensor": "palpate.adapters.watchdogs",
        "WatchedJointEncoder": "palpate.adapters.watchdogs",
        "build_perception": "palpate.adapters.composition",
        "build_supervisor": "palpate.adapters.composition",
        "build_task": "palpate.adapters.composition",
        "comparator": "palpate.adapters.policies",
        "find_ready_pose": "palpate.adapters.composition",
        "main": "palpate.adapters.cli.main",
        "run_scored_trial": "palpate.adapters.experiment",
        "scenario": "palpate.adapters.config",
    },
    lambda config: (config,),
)
SEAM = replace(
    FOLDED,
    sign="core/palpate/core/trial/task.py",
    modules={**FOLDED.modules, "find_ready_pose": "palpate.core.trial.ready_pose"},
)
LAYOUTS = (SEAM, FOLDED, BEFORE)
"""The newest first: the first whose sign is there counts."""

PATIENT = (
    *("--supervision.max-tracking-error-mrad", "100", "--supervision.max-gap-ms", "1000"),
    *("--supervision.max-force-age-ms", "1000", "--supervision.max-joint-age-ms", "1000"),
    *("--supervision.max-repeats", "140", "--supervision.unexpected-contact-N", "29"),
    *("--supervision.max-equal-samples", "1000", "--supervision.max-force-rate-N-s", "30000"),
    *("--supervision.weakened", "max_force_rate_N_s", "unexpected_contact_N", "max_tracking_error_mrad", "max_gap_ms"),
    *("max_force_age_ms", "max_joint_age_ms", "max_repeats", "max_equal_samples"),
)
"""A loop that is profiled is late; what it walks through does not change by that."""
_NEVER_NS = 10**15


class Parts:
    """The names of one checkout, by the layout that it has. It is imported from then on, here and in child processes.

    Args:
        checkout: Whose parts.
        folder: For what has to be written down for that.
    """

    def __init__(self, checkout: Path, folder: Path) -> None:
        found = [layout for layout in LAYOUTS if (checkout / layout.sign).exists()]
        if not found:
            raise SystemExit(f"{checkout}: none of the layouts in {__file__} fits")
        self.layout = found[0]
        path = import_path(checkout, folder / "metadata")
        sys.path[:0] = path
        os.environ["PYTHONPATH"] = os.pathsep.join(path)

    def __getattr__(self, name: str) -> Any:
        module, _, other = self.layout.modules[name].partition(":")
        return getattr(import_module(module), other or name)


def over_simulated_ports(checkout: Path, folder: Path, walk: Callable[[Trial], None], *, rig: bool) -> None:
    """A supervised trial over the simulated cell's ports: bare, or under all that a rig's run puts over its devices.

    Args:
        checkout: Whose parts.
        folder: Where files may go.
        walk: Is given the trial, to run it.
        rig: Watched, timed and recorded, as ``palpate run --rig`` composes it; on the cell's clock, so that every
            run is the same, and without what only the system or a person brings (accounts of threads, operator).
    """
    parts = Parts(checkout, folder)
    config = parts.scenario("paper")
    ready, perception = parts.find_ready_pose(*parts.layout.ready_from(config)), parts.build_perception(config)
    policy, build, trial = parts.comparator("torque", config, tuple), parts.build_supervisor, parts.run_scored_trial
    with parts.SimulatedRig(config, ready) as cell:
        # Once the noise of the sensor was taken from the configuration.
        supervisor = (
            build(config, ready, cell.sensor_facts) if "sensor" in signature(build).parameters else build(config)
        )
        if not rig:
            task = parts.build_task(config, ready, perception, policy)
            walk(lambda: trial(config, cell, task, 0, None, 0, supervisor))
            return
        session = parts.RealTimeSession(config.real_time)
        session.stopwatch = parts.Stopwatch()
        # Before loops had observers, a task was timed by what was put around its parts.
        timed = {"stopwatch": session.stopwatch} if "stopwatch" in signature(parts.build_task).parameters else {}
        task = parts.build_task(config, ready, perception, policy, **timed)
        clock, sensor, encoder = cell.ports.clock, cell.ports.force_sensor, cell.ports.joint_encoder
        arm = parts.WatchedArm(cell.ports.arm, clock, _NEVER_NS)
        # Later checkouts watch the clock only for a watchdog's process, which a rig has if its file asks for one.
        always = "watchdogs" in signature(parts.WatchedClock).parameters
        cell.ports = parts.Ports(
            parts.WatchedClock(clock, ()) if always else clock,
            parts.WatchedForceSensor(sensor, clock, _NEVER_NS, dead_after_ns=_NEVER_NS),
            parts.WatchedJointEncoder(encoder, clock, _NEVER_NS, dead_after_ns=_NEVER_NS),
            parts.GuardedArm(arm, [], ()),
        )
        with parts.TrialRecorder.into(folder / "logs", config.recording) as recorder:
            recorder.of("run", config, ready, task, perception, policy, name="torque")
            walk(lambda: trial(config, cell, task, 0, recorder, 0, supervisor, session))
        arm.close()


def over_emulated_devices(checkout: Path, folder: Path, walk: Callable[[Trial], None], arm: str, force: str) -> None:
    """``palpate run --rig`` itself, in this process, over devices that ``palpate emulate`` serves in another."""
    parts = Parts(checkout, folder)
    rig = folder / "rig.toml"
    words = ("run", "--rig", str(rig), "--policy", "torque", "--trials", "1", "--out", str(folder / "run"), *PATIENT)

    def trial() -> None:
        if parts.main(words) != 0:
            raise SystemExit("the run on the emulated rig failed")

    palpate = sys.executable, "-m", parts.main.__module__
    with EmulatedRig(folder, *words_of(arm, force, 30), palpate=palpate):
        _relax(rig)
        walk(trial)


def _relax(rig: Path) -> None:
    arm, sensor = rig.read_text().split("[force_sensor]\n")
    patience = "" if "patience" in arm else "patience = 10.0\n"
    arm = arm.replace("[arm]\n", f"[arm]\nmax_age_ms = 1000.0\n{patience}")
    arm = arm.replace("[rig]\n", "[rig]\napproach_rad_s = 0.8\n")
    watchdog = "[watchdog]\ncommand_ms = 10000.0\nsensor_ms = 10000.0\n"
    rig.write_text(f"{watchdog}{arm}[force_sensor]\nmax_age_ms = 1000.0\n{sensor}")
