"""An emulated UR5 through the real client ur_rtde: insertions, and a connection that breaks and is made again.

    python -m benchmarks.ur                                       20 insertions (3 minutes), then 100 breaks (4 minutes)
    python -m benchmarks.ur --trials 20 --breaks 0 --policy runs/paper/policy.json
    python -m benchmarks.ur --trials 0 --breaks 100

Insertions are `palpate run --rig` with the emulated ATI sensor, both sides with real-time scheduling where the system
grants it; what counts is what the emulated cell saw. A break cuts all connections of the controller between two
activations of the arm, as between two trials; every tenth does so in mid-motion, where a person has to acknowledge it.
It counts as made again when the arm is led from one pose to another afterwards and stands there.

The contract suites over the same sockets:

    palpate check-adapter benchmarks.ur:arm_rig
    palpate check-adapter benchmarks.ur:encoder_rig
    palpate check-adapter benchmarks.ur:sensor_rig
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rigs import latencies, run_on_rig, times_of
from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.real_time import take_real_time
from palpate.adapters.hardware.ur import make_ur_rtde, make_ur_tool_force
from palpate.adapters.log.reader import read_log
from palpate.core.errors import PalpateError
from palpate.core.ports import JointCommand, Life
from palpate.core.ports.contracts import ArmCommandRig, ForceSensorRig, JointEncoderRig
from palpate.simulation.emulators.ur import UrController, UrServer

HOME = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
THERE = (*HOME[:5], 0.25)
NEAR_RAD = 2e-3
PRIORITY = 30


def loop_rate_Hz(out: Path) -> tuple[float, float]:
    """Ticks a second and new joint samples a second over all trials."""
    ticks, fresh, seconds = 0, 0, 0.0
    for path in sorted((out / "logs").glob("*.mcap")):
        records = [r for r in read_log(path).records() if r.joints is not None and r.time_ns is not None]
        times = [r.time_ns for r in records if r.time_ns is not None]
        ticks, fresh = ticks + len(records), fresh + len({r.joints.sequence for r in records if r.joints})
        seconds += (times[-1] - times[0]) * 1e-9 if times else 0.0
    return ticks / max(seconds, 1e-9), fresh / max(seconds, 1e-9)


def insertions(policy: str, trials: int, seed: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        words = ("--arm", "ur5-rtde", "--force", "ati-netft", "--priority", str(PRIORITY))
        more = ("--arm", "ur5", "--real-time.scheduling")
        inserted, out, problem = run_on_rig(Path(name), policy, trials, seed, words, more)
        print(f"ur5-rtde and ati-netft: {inserted} of {trials} inserted {problem}")
        times = np.array(times_of(out) or [np.nan])
        print(f"  exploration: median {np.median(times):.2f} s, mean {times.mean():.2f} s; {latencies(out)}")
        ticks_Hz, fresh_Hz = loop_rate_Hz(out)
        print(f"  {ticks_Hz:.1f} ticks and {fresh_Hz:.1f} new joint samples a second", flush=True)


class Following(UrController):
    """Joints that stand at their set-points at once."""

    def step(self, now_ns: int) -> None:
        super().step(now_ns)
        self.measured_rad(self.targets_rad())


def lead(arm: Any, there: tuple[float, ...], seconds: float = 0.4) -> bool:
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        arm.send(JointCommand(there))
        time.sleep(1 / 140)
    return max(abs(a - b) for a, b in zip(arm.read().position_rad, there, strict=True)) < NEAR_RAD


def breaks(count: int) -> None:
    print(f"emulator and adapter: {take_real_time(PRIORITY)}")
    controller = Following(HOME, lambda now_ns: (0.0, 0.0, -5.0, 0.0, 0.0, 0.0))
    with UrServer(controller) as server:
        arm: Any = make_ur_rtde({"host": server.host}, RigContext.of("ur5", MonotonicClock())).arm
        good, troubles, took_s = 0, [], []
        with arm:
            for trial in range(count):
                there = THERE if trial % 2 else HOME
                in_motion = trial % 10 == 9
                try:
                    if in_motion:
                        require_broken(arm, server, there)
                        arm.acknowledge_fault()
                    else:
                        arm.stop()
                        server.cut()
                        time.sleep(0.02 * (trial % 5))
                        arm.deactivate()
                    since_s = time.monotonic()
                    arm.activate()
                    took_s.append(time.monotonic() - since_s)
                    good += lead(arm, there)
                except PalpateError as error:
                    troubles.append(f"{trial}: {error}")
                    if arm.life is Life.FAULTED:
                        arm.acknowledge_fault()
                    if arm.life is not Life.ACTIVE:
                        arm.activate()
    print(f"connection broken and made again: {good} of {count}; ready after {np.median(took_s):.2f} s (median)")
    print("".join(f"  {trouble}\n" for trouble in troubles), end="")


def on_sockets(made: Callable[[UrServer, UrController, RigContext], dict[str, Any]]) -> dict[str, Any]:
    """What the rigs have in common: a controller of their own, served until the clause is over."""
    controller = Following(HOME, lambda now_ns: (0.0, 0.0, -5.0, 0.0, 0.0, 0.0))
    server = UrServer(controller)
    server.__enter__()
    clock = MonotonicClock()

    def fail() -> None:
        with server.exclusive():
            controller.end_program()
        time.sleep(0.5)

    def unplug() -> None:
        server.network.is_unplugged = True
        time.sleep(0.3)

    return {
        "clock": clock, "advance": lambda ticks: time.sleep(ticks / 140), "dispose": server.__exit__,
        "disconnect": unplug, "runs_by_itself": True, "provoke_fault": fail, "call_budget_ns": 50_000_000,
        **made(server, controller, RigContext.of("ur5", clock)),
    }  # fmt: skip


def patient_arm(server: UrServer, context: RigContext) -> Any:
    return make_ur_rtde({"host": server.host, "patience": 2.0, "max_age_ms": 200.0}, context).arm


def arm_rig() -> ArmCommandRig:
    def made(server: UrServer, controller: UrController, context: RigContext) -> dict[str, Any]:
        upper = tuple(q + 0.05 for q in HOME)
        context = replace(context, upper_rad=upper, velocity_limit_rad_s=(1.0,) * 6)
        return {
            "device": patient_arm(server, context), "home_rad": HOME,
            "lower_rad": context.lower_rad, "upper_rad": upper, "step_rad": 4e-3, "fast_step_rad": 0.03,
            "position_rad": controller.targets_rad, "tolerance_rad": 2e-4, "settle_ticks": 60, "limit_ticks": 100,
        }  # fmt: skip

    return ArmCommandRig(**on_sockets(made))


def encoder_rig() -> JointEncoderRig:
    def made(server: UrServer, controller: UrController, context: RigContext) -> dict[str, Any]:
        arm = patient_arm(server, context)
        return {
            "device": arm, "arm": arm, "joints": 6, "expected_rad": HOME, "tolerance_rad": 2e-4,
            "max_age_ns": 300_000_000, "go_silent": lambda: setattr(server.network, "is_silent", True),
        }  # fmt: skip

    return JointEncoderRig(**on_sockets(made))


def sensor_rig() -> ForceSensorRig:
    def made(server: UrServer, controller: UrController, context: RigContext) -> dict[str, Any]:
        return {
            "device": make_ur_tool_force({"host": server.host}, context), "max_age_ns": 100_000_000,
            "go_silent": lambda: setattr(server.network, "is_silent", True), "provoke_fault": None,
        }  # fmt: skip

    return ForceSensorRig(**on_sockets(made))


def require_broken(arm: Any, server: UrServer, there: tuple[float, ...]) -> None:
    server.cut()
    try:
        lead(arm, there, 3.0)
    except PalpateError:
        deadline_s = time.monotonic() + 3.0
        while arm.life is not Life.FAULTED and time.monotonic() < deadline_s:
            time.sleep(0.01)
        return
    raise PalpateError("a connection that was cut in motion is no fault")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--breaks", type=int, default=100)
    parser.add_argument("--policy", default="torque")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    if options.trials:
        insertions(options.policy, options.trials, options.seed)
    if options.breaks:
        # In a process of its own: real-time scheduling is not given back.
        again = [sys.executable, "-c", f"from benchmarks.ur import breaks; breaks({options.breaks})"]
        subprocess.run(again, check=True)


if __name__ == "__main__":
    main()
