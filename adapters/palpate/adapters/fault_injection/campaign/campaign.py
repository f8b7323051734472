"""All faults in all phases, over seeds: in lock-step in the simulator, or on a rig in real time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import open_rig
from palpate.adapters.fault_injection.campaign.runs import PHASES, Bench, FaultRun
from palpate.adapters.fault_injection.campaign.variants import Variant, variants
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.insertion import Phase, ReadyPose, find_ready_pose


@dataclass(frozen=True)
class Case:
    """One run to be made.

    Attributes:
        variant: The fault.
        phase: In which phase it strikes.
        seed: Of trial, tick and fault.
    """

    variant: Variant
    phase: Phase
    seed: int


def cases(config: RunConfig, seeds: int, most: int = 0) -> list[Case]:
    """Every fault in every phase for every seed; or so many of them, spread evenly over all."""
    every = [
        Case(variant, phase, seed)
        for seed in range(seeds)
        for variant in variants(config.supervision)
        for phase in PHASES
    ]
    if not most or most >= len(every):
        return every
    return [every[index] for index in np.linspace(0, len(every) - 1, most).round().astype(int)]


def run_cases(
    config: RunConfig, chosen: Sequence[Case], *, rig_file: str, supervised: bool, jobs: int
) -> Iterator[list[FaultRun]]:
    """Run them, seed by seed; results do not depend on the number of processes.

    Args:
        config: The run's configuration.
        chosen: What to run.
        rig_file: The devices to run on, one trial after the other; the simulator if it is empty.
        supervised: False lets every command through.
        jobs: Number of processes in the simulator.
    """
    ready = find_ready_pose(config.arm, config.task)
    by_seed: dict[int, list[Case]] = {}
    for case in chosen:
        by_seed.setdefault(case.seed, []).append(case)
    if rig_file or jobs == 1:
        yield from _on_one_rig(config, ready, list(by_seed.values()), rig_file, supervised)
        return
    tasks = (delayed(_one_seed)(config, ready, own, supervised) for own in by_seed.values())
    yield from Parallel(n_jobs=jobs, return_as="generator")(tasks)


def _on_one_rig(
    config: RunConfig, ready: ReadyPose, parts: Sequence[Sequence[Case]], rig_file: str, supervised: bool
) -> Iterator[list[FaultRun]]:
    with ExitStack() as opened, open_rig(config, ready, rig_file) as rig:
        session = opened.enter_context(RealTimeSession(config.real_time)) if rig_file else None
        bench = Bench(config, ready, rig, supervised=supervised, session=session)
        for own in parts:
            windows = bench.windows(own[0].seed)
            for case in own:
                yield [_run(bench, case, windows)]


def _one_seed(config: RunConfig, ready: ReadyPose, own: Sequence[Case], supervised: bool) -> list[FaultRun]:
    with open_rig(config, ready, "") as rig:
        bench = Bench(config, ready, rig, supervised=supervised)
        windows = bench.windows(own[0].seed)
        return [_run(bench, case, windows) for case in own]


def _run(bench: Bench, case: Case, windows: dict[Phase, range]) -> FaultRun:
    window = windows.get(case.phase, range(1))
    names = [variant.name for variant in variants(bench.config.supervision)]
    place = (case.seed, names.index(case.variant.name), PHASES.index(case.phase))
    tick = int(np.random.default_rng(np.random.SeedSequence(place)).integers(window.start, window.stop))
    return bench.run(case.variant, case.phase, tick, case.seed)
