"""palpate gap on a cell that differs (friction 0.35, stiffness x0.7, latency 20 ms): how far off what it finds is.

    python -m benchmarks.gap --trials 8 --draws 3
    python -m benchmarks.gap --trials 6 --draws 8 --wires cia402 jr3-can      over the drivers and virtual wires

Arms are zebra-nmc, cia402 and ur5-rtde, sensors jr3-can, jr3-uart and ati-netft.

Over wires the latency is held against that of a second set of trials, of the same cell without a latency of its own,
with friction, stiffnesses and damping of both together (as palpate gap --reference).
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np

from palpate.adapters.config import RunConfig, overlay, scenario
from palpate.adapters.experiments import ChosenPolicy, RunFolder, run_chosen
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay import Gap, find_logs, gap_of, gaps_of
from palpate.core.errors import DeviceError
from palpate.core.ports import CONTROL_RATE_HZ, Rig
from palpate.core.trial import ReadyPose, find_ready_pose
from palpate.simulation.work_cell import HiddenValues
from tests.virtual_rig import VirtualRig

POLICY = "torque"
TRUE = {"friction": 0.35, "axial": 0.7, "across": 0.7, "latency_ms": 20.0}
MadeRig = Callable[[RunConfig, ReadyPose, HiddenValues], Rig]


def record(
    folder: Path, seed: int, trials: int, made: MadeRig = SimulatedRig, latency_ms: float = 20.0,
    arm: str = "zebra-zero",
) -> list[Path]:  # fmt: skip
    """Logs of trials on that cell, in virtual time; on a rig they end with the first that trips."""
    known = {"control": {"axial_stiffness_N_per_mm": 3.5}} if made is not SimulatedRig else {}
    config = overlay(replace(scenario("paper"), seed=seed, arm=arm), known)
    ready, chosen = find_ready_pose(config.arm, config.task), ChosenPolicy(POLICY, config)
    other = HiddenValues(springs_share=0.7, friction=0.35, latency_ms=latency_ms)
    with ExitStack() as opened, made(config, ready, other) as rig:
        recorder = RunFolder(folder).recorder(config.recording, opened)
        try:
            run_chosen(chosen, config, ready, rig, trials, recorder=recorder)
        except DeviceError as error:
            print(f"{seed} {error}", flush=True)
    return find_logs([folder])


def found(gap: Gap) -> dict[str, tuple[float, float]]:
    """The same of a fit, each with its deviation."""
    friction, axial, across, *_ = zip(gap.values.tolist(), gap.sds.tolist(), strict=True)
    late = gap.wrench_late_ms, float(gap.sds[-1]) * 1e3 / CONTROL_RATE_HZ
    return {"friction": friction, "axial": axial, "across": across, "latency_ms": late}


def main() -> None:
    """Print what each draw finds, and its error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--draws", type=int, default=3)
    parser.add_argument("--first", type=int, default=100, help="seed of the first draw")
    parser.add_argument("--wires", nargs=2, metavar=("ARM", "FORCE"), help="such as cia402 jr3-can")
    options = parser.parse_args()
    arm = "ur5" if options.wires and options.wires[0] == "ur5-rtde" else "zebra-zero"
    for seed in range(options.first, options.first + options.draws):

        def made(config: RunConfig, ready: ReadyPose, other: HiddenValues, seed: int = seed) -> Rig:
            return VirtualRig(config, ready, *options.wires, other, phase=np.random.default_rng(seed).random())

        with tempfile.TemporaryDirectory() as folder:
            if options.wires:
                delayed = record(Path(folder) / "late", seed, options.trials, made, arm=arm)
                bare_logs = record(Path(folder) / "bare", seed, options.trials, made, 0.0, arm)
                gap, bare = gaps_of(delayed, bare_logs, lambda: None)
                late, wires = gap.wrench_late_ms, bare.wrench_late_ms
                print(f"{seed} {gap.logs} logs, sum of the delays: {late:.1f} ms, of the wires alone: {wires:.1f} ms")
                values = found(gap)
                apart = hypot(gap.wrench_late_sd_ms, bare.wrench_late_sd_ms)
                values["latency_ms"] = gap.cycle_late_ms - bare.cycle_late_ms, apart
            else:
                gap = gap_of(record(Path(folder), seed, options.trials), lambda: None)
                values = found(gap)
        for name, (value, sd) in values.items():
            away = 100.0 * (value / TRUE[name] - 1.0)
            covered = "within" if abs(value - TRUE[name]) <= 2.0 * sd else "BEYOND"
            told = f"{'met' if abs(away) <= 10.0 else 'NOT MET'}, {covered} two deviations of {sd:.2g}"
            print(f"{seed} {name}: {value:.4g}, {away:+.1f} % off: {told}", flush=True)
        before, after = (f"{errors.wrench[2]:.3g}" for errors in (gap.before, gap.after))
        print(f"{seed} Fz: {before} N as configured, {after} N fitted", flush=True)


if __name__ == "__main__":
    main()
