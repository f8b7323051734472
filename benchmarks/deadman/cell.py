"""The emulated cell at work, and where its joints were when."""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile
from pathlib import Path

import numpy as np

from benchmarks.deadman.arm import FASTEST_RAD_S
from palpate.adapters.config import EmulationConfig
from palpate.adapters.config.run import scenario
from palpate.adapters.hardware.emulated_cell import EmulatedCell
from palpate.adapters.hardware.real_time import take_real_time
from palpate.core.trial.ready_pose import find_ready_pose

STILL_RAD, REST_RAD_S = 1e-6, 0.005
LOOK_S = 0.002
EMULATED_PRIORITY = 30


class Watched:
    """The emulated cell at work in a thread, and where its joints were when."""

    def __init__(self, cell: EmulatedCell) -> None:
        self.cell, self.ended = cell, False
        self.held: deque[tuple[int, tuple[float, ...]]] = deque(maxlen=2000)
        self.stood: deque[tuple[int, tuple[float, ...]]] = deque(maxlen=1000)
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self.run, self.watch)]
        for thread in self.threads:
            thread.start()

    def run(self) -> None:
        self.cell.run(self.look, lambda truth: None)

    def look(self) -> bool:
        self.stood.append((time.monotonic_ns(), tuple(self.cell.cell.joint_angles())))
        return self.ended

    def watch(self) -> None:
        while not self.ended:
            self.held.append((time.monotonic_ns(), self.cell.targets_rad()))
            time.sleep(LOOK_S)

    def last_motion_ns(self, since_ns: int) -> tuple[int, int, int, int]:
        """When what the motors hold first and last moved, when a joint was last fast, and the longest blink."""
        held_ns, held = since(self.held, since_ns)
        stood_ns, stood = since(self.stood, since_ns)
        moved = held_ns[1:][np.abs(np.diff(held, axis=0)).max(axis=1) > STILL_RAD]
        speed = np.abs(np.diff(stood, axis=0)).max(axis=1) / (np.diff(stood_ns) * 1e-9)
        fast = stood_ns[1:][speed > REST_RAD_S]
        blink_ns = int(np.diff(held_ns).max())
        return min(moved, default=1 << 62), max(moved, default=0), max(fast, default=0), blink_ns


def since(noted: deque[tuple[int, tuple[float, ...]]], begin_ns: int) -> tuple[np.ndarray, np.ndarray]:
    """The newest notes. Quickly: the emulated devices wait for this interpreter."""
    newest = list(takewhile(lambda entry: entry[0] >= begin_ns, reversed(noted.copy())))[::-1]
    times, angles = zip(*newest, strict=True)
    return np.array(times), np.array(angles)


@contextmanager
def emulated(arm: str, folder: Path, rt: bool) -> Iterator[tuple[Watched, Path, str]]:
    config = replace(scenario("paper"), seed=1, **({"arm": "ur5"} if arm == "ur5-rtde" else {}))
    counts = str(folder / "counts.json")
    emulation = EmulationConfig(arm=arm, force="jr3-can")
    if rt:
        take_real_time(EMULATED_PRIORITY)
    with EmulatedCell(config, find_ready_pose(config.arm, config.task), emulation, counts) as cell:
        rig = folder / "rig.toml"
        # Where the adapter has a limit of its own, that is the one of the rig files that come with palpate.
        text = cell.rig_toml()
        own = f"velocity_rad_s = {FASTEST_RAD_S}\n" if arm == "zebra-nmc" else ""
        rig.write_text(text.replace("[arm]\n", f"[arm]\n{own}"))
        watched = Watched(cell)
        if rt:
            # All that serves has its priority; what is started from here on is not to compete with it.
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        try:
            yield watched, rig, config.arm
        finally:
            watched.ended = True
            for thread in watched.threads:
                thread.join()
