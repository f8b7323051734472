"""Cost of an environment step beyond its physics, compared with other MuJoCo manipulation environments.

    python -m benchmarks.environment_overhead --cache ~/.cache/palpate-peers
    python -m benchmarks.environment_overhead --cache ~/.cache/palpate-peers --peers none

Each peer runs from its published package in its own virtual environment in the cache folder. The first call creates
them (some hundred megabytes). Each peer uses the MuJoCo version that it needs, never 4.0, so only the ratios can be
compared. Rounds alternate, with one process per measurement, and the table gives medians over rounds.

The floor for each environment is ``mj_step`` on the same model, with the same number of steps and calls, the same
states and the same commands. Environments are made in the usual way, with ``gymnasium.make``; resets do not count.
Times are CPU times, which are less sensitive to other work on the machine.

This file is also the worker in every virtual environment, so it imports third-party packages only inside functions.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

STEPS = 400
SEED = 1


@dataclass
class Floor:
    """Bare physics of the steps of an environment: initial states, and the commands of each call of ``mj_step``.

    Attributes:
        model: The MuJoCo model.
        substeps: Physics steps per call.
        cell: The work cell, which steps several models; None if there is only one model.
        stretches: For each reset, the initial state (including the plate) and the commands of each call.
    """

    model: Any
    substeps: int
    cell: Any = None
    stretches: list[tuple[dict[str, Any], list[tuple[dict[str, Any], Any]]]] = field(default_factory=list)

    def begin(self, data: Any) -> None:
        begin = {
            name: getattr(data, name).copy() for name in ("qpos", "qvel", "act", "ctrl", "mocap_pos", "mocap_quat")
        }
        self.stretches.append((begin | {"body_pos": self.model.body_pos.copy()}, []))

    def command(self, data: Any) -> None:
        commands = {name: getattr(data, name).copy() for name in ("ctrl", "mocap_pos", "mocap_quat")}
        sent = {name: value for name, value in commands.items() if value.size}
        contacts = None if self.cell is None else self.cell.contacts
        stepped = self.model if contacts is None else contacts.models[contacts.level]
        self.stretches[-1][1].append((sent, stepped))

    def seconds(self) -> float:
        import mujoco

        data, total = mujoco.MjData(self.model), 0.0
        for begin, commands in self.stretches:
            mujoco.mj_resetData(self.model, data)
            for model in (self.model,) if self.cell is None else self.cell.models:
                model.body_pos[:] = begin["body_pos"]
            for name, value in begin.items():
                if name != "body_pos":
                    getattr(data, name)[:] = value
            mujoco.mj_forward(self.model, data)
            for command, stepped in commands:
                # Setting the commands is no physics.
                for name, value in command.items():
                    getattr(data, name)[:] = value
                start = time.process_time()
                mujoco.mj_step(stepped, data, self.substeps)
                total += time.process_time() - start
        return total

    @property
    def calls(self) -> int:
        return sum(len(commands) for _, commands in self.stretches)


def steps_of(env: Any, count: int, on_reset: Callable[[], None], after_step: Callable[[], None]) -> float:
    """Return the seconds taken by a number of steps with random actions, excluding resets."""
    env.action_space.seed(SEED)
    env.reset(seed=SEED)
    on_reset()
    total = 0.0
    for _ in range(count):
        action = env.action_space.sample()
        start = time.process_time()
        _, _, terminated, truncated, _ = env.step(action)
        total += time.process_time() - start
        after_step()
        if terminated or truncated:
            env.reset()
            on_reset()
    return total


def nothing() -> None:
    return


def palpate_round(count: int, **arguments: Any) -> dict[str, Any]:
    import gymnasium

    import palpate.adapters.gymnasium_envs as envs

    env: Any = gymnasium.make(envs.PEG_INSERTION, **arguments)
    steps_of(env, 20, nothing, nothing)
    seconds = steps_of(env, count, nothing, nothing)
    # Once more, equal to the bit, now with a look at every command: a step is many calls here.
    cell = env.unwrapped.cell
    floor = Floor(cell.model, cell.config.substeps, cell)
    stepping, advance = False, cell.advance

    def watched() -> None:
        advance()
        if stepping:
            floor.command(cell.data)

    def begin() -> None:
        nonlocal stepping
        floor.begin(cell.data)
        stepping = True

    reset = env.reset

    def plain_reset(**options: Any) -> Any:
        nonlocal stepping
        stepping = False
        return reset(**options)

    cell.advance, env.reset = watched, plain_reset
    steps_of(env, count, begin, nothing)
    return {"seconds": seconds, "floor": floor.seconds(), "calls": floor.calls, "substeps": floor.substeps}


def peer_round(count: int, env: Any, substeps: int) -> dict[str, Any]:
    steps_of(env, 20, nothing, nothing)
    inner = env.unwrapped
    floor = Floor(inner.model, substeps)
    seconds = steps_of(env, count, lambda: floor.begin(inner.data), lambda: floor.command(inner.data))
    return {"seconds": seconds, "floor": floor.seconds(), "calls": floor.calls, "substeps": substeps}


def fetch_round(count: int) -> dict[str, Any]:
    import gymnasium
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    name = max(
        (n for n in gymnasium.registry if n.startswith("FetchPickAndPlace-v")), key=lambda n: int(n.rsplit("v", 1)[1])
    )
    env: Any = gymnasium.make(name)
    return peer_round(count, env, env.unwrapped.n_substeps) | {"name": name}


def metaworld_round(count: int) -> dict[str, Any]:
    import gymnasium
    import metaworld

    assert metaworld.__file__
    env: Any = gymnasium.make("Meta-World/MT1", env_name="peg-insert-side-v3", seed=SEED)
    return peer_round(count, env, env.unwrapped.frame_skip) | {"name": "peg-insert-side-v3"}


WORKERS: dict[str, Callable[[int], dict[str, Any]]] = {
    "palpate, symbolic": palpate_round,
    "palpate, raw and continuous": lambda count: palpate_round(count, observations="raw", actions="continuous"),
    "gymnasium-robotics": fetch_round,
    "metaworld": metaworld_round,
}
PEERS = {
    "gymnasium-robotics": ["gymnasium-robotics==1.4.2", "mujoco>=3.10,<3.11"],
    "metaworld": ["metaworld==3.1.1", "mujoco==3.3.0", "packaging"],
}


def python_of(peer: str, cache: Path) -> Path:
    """Return the Python interpreter with this peer, which is installed first if necessary."""
    folder = cache / peer
    python, ready = folder / "bin" / "python", folder / "ready"
    wanted = " ".join(PEERS[peer])
    if not ready.exists() or ready.read_text(encoding="utf-8") != wanted:
        print(f"installing {wanted} into {folder}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PEERS[peer]]
        subprocess.run(pip, check=True)
        ready.write_text(wanted, encoding="utf-8")
    return python


def measured(name: str, python: Path, count: int) -> dict[str, Any]:
    """Measure one round in a separate process."""
    words = [str(python), "-W", "ignore", __file__, "--worker", name, "--steps", str(count)]
    # One thread each, whatever libraries would like.
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{name}: {done.stderr.strip().splitlines()[-1]}")
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def work(name: str, count: int) -> None:
    import mujoco

    result = WORKERS[name](count)
    print(json.dumps(result | {"steps": count, "mujoco": mujoco.__version__}))


def lines(rows: dict[str, list[dict[str, Any]]]) -> list[tuple[object, ...]]:
    found = []
    for name, rounds in rows.items():
        ratios, first = [one["seconds"] / one["floor"] for one in rounds], rounds[0]
        step_us, floor_us = (
            1e6 * statistics.median(one[what] / one["steps"] for one in rounds) for what in ("seconds", "floor")
        )
        spread = f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        per_step = f"{first['calls'] * first['substeps'] / first['steps']:.1f}"
        title = f"{name} ({first['name']})" if "name" in first else name
        found.append((title, first["mujoco"], per_step, f"{step_us:.0f}", f"{floor_us:.0f}", spread))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, help="folder for the peers' virtual environments")
    parser.add_argument("--peers", nargs="*", default=list(PEERS), help=f"none, or any of {', '.join(PEERS)}")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--steps", type=int, default=STEPS, help="environment steps of a round")
    parser.add_argument("--json", type=Path, help="write every round here")
    parser.add_argument("--worker", choices=WORKERS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.worker, options.steps)
        return
    peers = [peer for peer in options.peers if peer != "none"]
    if strange := [peer for peer in peers if peer not in PEERS]:
        parser.error(f"no such peer: {', '.join(strange)}; there are {', '.join(PEERS)}")
    if min(options.rounds, options.steps) < 1:
        parser.error("--rounds and --steps must be 1 or more")
    if peers and options.cache is None:
        parser.error("--cache FOLDER is needed for the peers, or --peers none")
    pythons = {name: Path(sys.executable) for name in WORKERS if name not in PEERS}
    pythons |= {peer: python_of(peer, options.cache.expanduser().resolve()) for peer in peers}
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in pythons}
    for number in range(options.rounds):
        for name, python in pythons.items():
            rows[name].append(measured(name, python, options.steps))
        print(f"round {number + 1} of {options.rounds}", file=sys.stderr)
    # Not at the beginning of the file: it is the worker of environments that lack palpate, too.
    from benchmarks.common import table

    head = ("environment", "MuJoCo", "physics steps a step", "step, CPU us", "bare physics, CPU us", "ratio (range)")
    print(table(head, lines(rows)))
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
