"""What ``benchmarks.tick_walk`` walks through: one trial of a checkout, composed of that checkout's own parts.

The one place that knows where things are: a layout's table says which module has which name. Whoever moves something
adds a layout, told by a file that only it has, and touches nothing else.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias

from benchmarks.house import ROOTS

Layout: TypeAlias = dict[str, str]
Trial: TypeAlias = Callable[[], object]

BEFORE: Layout = {
    "Beat": "palpate.adapters.beat",
    "GuardedArm": "palpate.adapters.watchdogs",
    "Ports": "palpate.core.cycle",
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
    "run_trial": "palpate.core.cycle",
    "scenario": "palpate.adapters.config",
    "trial_setup": "palpate.adapters.experiment",
}
LAYOUTS: dict[str, Layout] = {"core/palpate/core/cycle.py": BEFORE}

PATIENT = (
    *("--supervision.max-tracking-error-mrad", "100", "--supervision.max-gap-ms", "1000"),
    *("--supervision.max-force-age-ms", "1000", "--supervision.max-joint-age-ms", "1000"),
    *("--supervision.max-repeats", "140", "--supervision.unexpected-contact-N", "30"),
    *("--supervision.max-equal-samples", "1000", "--supervision.max-force-rate-N-s", "100000"),
    *("--supervision.weakened", "max_force_rate_N_s", "unexpected_contact_N", "max_tracking_error_mrad", "max_gap_ms"),
    *("max_force_age_ms", "max_joint_age_ms", "max_repeats", "max_equal_samples"),
)
"""A loop that is profiled is late; what it walks through does not change by that."""
_NEVER_NS = 10**15


class Parts:
    """The names of one checkout, by the layout that it has; its roots come first on ``sys.path`` from then on."""

    def __init__(self, checkout: Path) -> None:
        found = [layout for file, layout in LAYOUTS.items() if (checkout / file).exists()]
        if len(found) != 1:
            raise SystemExit(f"{checkout}: {len(found)} of the layouts in {__file__} fit, 1 is needed")
        self._layout = found[0]
        sys.path[:0] = import_path(checkout)

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self._layout[name]), name)


def import_path(checkout: Path) -> list[str]:
    return [str(checkout / root) for root in ROOTS]


def over_simulated_ports(checkout: Path, walk: Callable[[Trial], None], *, rig: bool) -> None:
    """A supervised trial over the simulated cell's ports: bare, or under all that a rig's run puts over its devices.

    Args:
        checkout: Whose parts.
        walk: Is given the trial, to run it.
        rig: Watched, timed and recorded, as ``palpate run --rig`` composes it; on the cell's clock, so that every
            run is the same, and without what only the system or a person brings (accounts of threads, operator).
    """
    parts = Parts(checkout)
    config = parts.scenario("paper")
    ready, perception = parts.find_ready_pose(config), parts.build_perception(config)
    policy, beat = parts.comparator("torque", config, tuple), parts.Beat(config.real_time)
    beat.stopwatch = parts.Stopwatch() if rig else None
    task = parts.build_task(config, ready, perception, policy, beat.stopwatch)
    setup, supervisor = parts.trial_setup(config, 0), parts.build_supervisor(config)
    with parts.SimulatedRig(config, ready) as cell, tempfile.TemporaryDirectory() as folder:
        cell.prepare(0)
        if not rig:
            walk(lambda: parts.run_trial(task, cell.ports, setup, supervisor))
            return
        clock, sensor, encoder = cell.ports.clock, cell.ports.force_sensor, cell.ports.joint_encoder
        arm = parts.WatchedArm(cell.ports.arm, clock, _NEVER_NS)
        ports = beat.timed(
            parts.Ports(
                parts.WatchedClock(clock, ()),
                parts.WatchedForceSensor(sensor, clock, _NEVER_NS, dead_after_ns=_NEVER_NS),
                parts.WatchedJointEncoder(encoder, clock, _NEVER_NS, dead_after_ns=_NEVER_NS),
                parts.GuardedArm(arm, [], ()),
            )
        )
        with parts.TrialRecorder.into(Path(folder), config.recording) as recorder:
            recorder.of("run", config, ready, task, perception, policy, name="torque")
            ports = beat.timed_recording(recorder.begin(setup, ports, cell.world(), "trial"))
            walk(lambda: parts.run_trial(task, ports, setup, supervisor))
        arm.close()


def over_emulated_devices(checkout: Path, walk: Callable[[Trial], None], arm: str, force: str) -> None:
    """``palpate run --rig`` itself, in this process, over devices that ``palpate emulate`` serves in another."""
    parts = Parts(checkout)
    with tempfile.TemporaryDirectory() as name:
        rig = Path(name) / "rig.toml"
        call = [sys.executable, "-m", parts.main.__module__, "emulate", "--rig-file", str(rig)]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(import_path(checkout))}
        cell = subprocess.Popen([*call, "--arm", arm, "--force", force], env=environment, stdout=subprocess.DEVNULL)
        try:
            while not (rig.exists() and "[force_sensor]" in rig.read_text()):
                if cell.poll() is not None:
                    raise SystemExit("the emulated devices ended before they were served")
                time.sleep(0.05)
            _relax(rig)
            words = ("run", "--rig", str(rig), "--policy", "torque", "--trials", "1", "--out", f"{name}/run", *PATIENT)
            walk(lambda: parts.main(words))
        finally:
            cell.terminate()
            cell.wait()


def _relax(rig: Path) -> None:
    arm, sensor = rig.read_text().split("[force_sensor]\n")
    arm = arm.replace("[arm]\n", "[arm]\nmax_age_ms = 1000.0\npatience = 10.0\n")
    arm = arm.replace("[rig]\n", "[rig]\napproach_rad_s = 0.8\n")
    watchdog = "[watchdog]\ncommand_ms = 2000.0\nsensor_ms = 2000.0\n"
    rig.write_text(f"{watchdog}{arm}[force_sensor]\nmax_age_ms = 1000.0\n{sensor}")
