"""How long after the loop's last word the arm is at rest, trial by trial."""

from __future__ import annotations

import argparse
import random
import signal
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.deadman.arm import NS
from benchmarks.deadman.cell import Watched, emulated
from benchmarks.deadman.loop import Loop

ALLOWED_MS = 50.0


class Trial(NamedTuple):
    """When all motion had ended, in ms beyond the deadman's time after the last set-point.

    Attributes:
        still_ms: Of what the motors hold.
        rest_ms: Of the simulated joints, down to 0.005 rad/s.
        blink_ms: Longest time between two looks.
        was_moving: Whether the motors moved before. One that stood already shows nothing.
    """

    still_ms: float
    rest_ms: float
    blink_ms: float
    was_moving: bool


def silence(way: str, loop: Loop) -> None:
    if way == "killed":
        loop.note_arms()
        loop.process.kill()
    elif way == "stopped":
        loop.process.send_signal(signal.SIGSTOP)
    else:
        loop.say()


def one_trial(way: str, loop: Loop, watched: Watched, rng: random.Random, deadman_ms: float) -> tuple[Trial, str]:
    """What was seen, and what the loop said of it."""
    time.sleep(rng.uniform(0.2, 0.5))
    loop.forget()
    silence(way, loop)
    time.sleep(deadman_ms * 1e-3 + 0.5)
    last_ns = loop.last_set_ns()
    first_ns, still_ns, rest_ns, blink_ns = watched.last_motion_ns(last_ns - NS // 20)
    beyond = ((at - last_ns) * 1e-6 - deadman_ms for at in (still_ns, rest_ns))
    trial = Trial(*beyond, blink_ns * 1e-6, first_ns < last_ns)
    said = ""
    if way == "killed":
        loop.kill()
    else:
        if way == "stopped":
            loop.process.send_signal(signal.SIGCONT)
        said = loop.until_moving()
    return trial, said


def bench(arm: str, options: argparse.Namespace) -> None:
    rng = random.Random(1)
    with tempfile.TemporaryDirectory() as name, emulated(arm, Path(name), options.rt) as (watched, rig, model):
        start = ",".join(map(str, watched.cell.cell.joint_angles()))
        for way in options.ways:
            seen: list[Trial] = []
            said: dict[str, int] = {}
            at_work = Loop(rig, model, Path(name), start, options)
            after = None
            try:
                for _ in range(options.trials):
                    if way == "killed" and after is None:
                        at_work.until_moving()
                        after = Loop(rig, model, Path(name), start, options)
                    elif not seen:
                        at_work.until_moving()
                    trial, text = one_trial(way, at_work, watched, rng, options.deadman_ms)
                    seen.append(trial)
                    text = text.partition("; ")[2] or text
                    said[text] = said.get(text, 0) + 1
                    if after is not None:
                        at_work, after = after, None
            finally:
                at_work.kill()
                if after is not None:
                    after.kill()
            judge(arm, way, seen, options)
            for text, count in sorted(said.items(), key=lambda entry: -entry[1]):
                if text:
                    print(f"    {count} x {text}")


def judge(arm: str, way: str, seen: list[Trial], options: argparse.Namespace) -> None:
    still, swung = (np.array(values) for values in zip(*(t[:2] for t in seen), strict=True))
    unmoved = sum(not trial.was_moving for trial in seen)
    good = sum(trial.was_moving and trial.still_ms <= ALLOWED_MS for trial in seen)
    print(
        f"{arm}, {way}: at rest within {ALLOWED_MS:g} ms of the deadman's {options.deadman_ms:g} ms in {good} of"
        f" {len(seen)}; beyond it median {np.median(still):.1f}, most {still.max():.1f} ms;"
        f" the simulated arm swung until {np.median(swung):.0f} ms" + (f"; {unmoved} did not move" if unmoved else "")
    )
    print(f"    the bench itself was blind for {max(t.blink_ms for t in seen):.1f} ms at most", flush=True)
