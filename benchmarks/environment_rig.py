"""A Stable-Baselines3 agent on an emulated rig, over real wires, through the Gymnasium environment.

    pip install -e '.[gymnasium]' -r examples/stable_baselines3/requirements.txt -c constraints.txt
    python -m benchmarks.environment_rig                        train in the simulator, then all three parts; 5 minutes
    python -m benchmarks.environment_rig --model agent.zip      keep the agent there, or take the one that is there
    python -m benchmarks.environment_rig --trials 2 --hangs 3 --patient      a short form, on a busy machine

The agent is the DQN over 17 states of the example, after 150 trials in the simulator. Parts: insertions as fast as it
decides; the same agent asleep for 150 ms before one decision in five; asleep for 400 ms, where the arm must be stopped
and the rig latched. What counts as inserted is what the emulated cell saw; the core's own account stands beside.
"""

from __future__ import annotations

import argparse
import random
import runpy
import tempfile
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3 import DQN

from benchmarks.emulated_rig import EmulatedRig, words_of
from palpate.adapters.gymnasium_envs import PEG_INSERTION
from palpate.adapters.gymnasium_envs.handover import LateAgentError
from palpate.core.errors import DeviceError, FaultLatchedError

ROOT = Path(__file__).parents[1]
STILL_RAD = 1e-3
WEAK = {
    "max_tracking_error_mrad": 100.0, "max_gap_ms": 1000.0, "max_force_age_ms": 1000.0, "max_joint_age_ms": 1000.0,
    "max_repeats": 140, "unexpected_contact_N": 30.0, "max_equal_samples": 1000, "flat_line_samples": 1000,
    "max_force_rate_N_s": 30_000.0, "max_force_N": 40.0,
}  # fmt: skip
PATIENT: dict[str, Any] = {"supervision": {**WEAK, "weakened": list(WEAK)}, "real_time": {"scheduling": True}}


def trained(path: Path, trials: int) -> DQN:
    """The example's agent, trained in the simulator unless it is there already."""
    if not path.exists():
        example = runpy.run_path(str(ROOT / "examples" / "stable_baselines3" / "train.py"))
        curve, model = example["Curve"]("DQN"), example["dqn"](0)
        model.learn(total_timesteps=100 * trials, callback=example["Trials"](curve, trials))
        print(curve.line(), flush=True)
        model.save(path)
    return DQN.load(path, device="cpu")


def relax(rig: Path) -> None:
    text = rig.read_text()
    patience = "" if "patience" in text else "patience = 4.0\n"
    text = text.replace("[arm]\n", f"[arm]\nmax_age_ms = 1000.0\n{patience}")
    text = text.replace("[force_sensor]\n", "[force_sensor]\nmax_age_ms = 1000.0\n")
    rig.write_text(f"[watchdog]\ncommand_ms = 2000.0\nsensor_ms = 2000.0\n{text}")


def drive(env: Any, model: DQN, trials: int, asleep_s: float, cell: EmulatedRig, name: str) -> None:
    """Trials to their end."""
    before, core, late, times, decisions = cell.inserted, 0, 0, [], 0
    # A network's first answer takes longest.
    model.predict(env.observation_space.sample())
    for trial in range(trials):
        try:
            seen, info = env.reset(seed=500 if trial == 0 else None)
            over = False
            while not over:
                if asleep_s and random.random() < 0.2:
                    time.sleep(asleep_s)
                action, _ = model.predict(seen)
                seen, _, terminated, truncated, info = env.step(action)
                over = terminated or truncated
        except DeviceError as error:
            print(f"{name}: trial {trial} failed: {error}", flush=True)
            if env.unwrapped.rig.latch.cause:
                env.unwrapped.rig.latch.acknowledge("benchmark", "an emulated rig")
            continue
        core, late, decisions = core + info["is_success"], late + info["late_decisions"], decisions + info["decisions"]
        times.append(info["exploration_time_s"])
    time.sleep(0.5)
    print(
        f"{name}: {cell.inserted - before} of {trials} inserted ({core} by the core's account), exploration median"
        f" {np.median(times):.2f} s, {decisions} decisions, {late} of them late",
        flush=True,
    )


def hang(env: Any, model: DQN, times: int) -> None:
    """An agent that sleeps for 400 ms after its third decision, again and again."""
    stopped, took = 0, []
    for _ in range(times):
        seen, _ = env.reset()
        for _ in range(2):
            seen, _, terminated, truncated, _ = env.step(model.predict(seen)[0])
            if terminated or truncated:
                seen, _ = env.reset()
        time.sleep(0.4)
        try:
            env.step(model.predict(seen)[0])
        except LateAgentError as error:
            took.append(float(str(error).split(" for ")[1].split()[0]))
        else:
            continue
        rig = env.unwrapped.rig
        encoder, latch = rig.ports.joint_encoder, rig.latch
        here = encoder.read().position_rad
        time.sleep(0.05)
        still = max(abs(a - b) for a, b in zip(encoder.read().position_rad, here, strict=True)) < STILL_RAD
        try:
            env.reset()
        except FaultLatchedError:
            stopped += still
        latch.acknowledge("benchmark", "an emulated rig")
    worst = f"at most {max(took):.3f} s after it was asked" if took else "never"
    print(f"asleep for 400 ms: {stopped} of {times} stopped, at rest and latched, {worst}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, help="the trained agent; made there if it is not")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--slow", type=int, default=5, help="trials of the agent that sleeps for 150 ms")
    parser.add_argument("--hangs", type=int, default=50)
    parser.add_argument("--patient", action="store_true", help="limits for a machine that is busy with other work")
    parser.add_argument("--arm", default="zebra-nmc")
    parser.add_argument("--force", default="jr3-can")
    parser.add_argument("--out", type=Path, help="folder for the recording; a temporary one without")
    options = parser.parse_args()
    random.seed(0)
    with tempfile.TemporaryDirectory() as name:
        model = trained(options.model or Path(name) / "agent.zip", 150)
        with EmulatedRig(Path(name), *words_of(options.arm, options.force, 30)) as cell:
            if options.patient:
                relax(cell.path)
            out = str(options.out or Path(name) / "run")
            config = PATIENT if options.patient else None
            with closing(gymnasium.make(PEG_INSERTION, rig=str(cell.path), out=out, config=config)) as env:
                if options.trials:
                    drive(env, model, options.trials, 0.0, cell, "as fast as it decides")
                if options.slow:
                    drive(env, model, options.slow, 0.15, cell, "asleep for 150 ms, one decision in five")
                if options.hangs:
                    hang(env, model, options.hangs)


if __name__ == "__main__":
    main()
