"""All faults in all phases, over seeds: in lock-step in the simulator, or on a rig in real time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final

import numpy as np
from joblib import Parallel, delayed

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import open_rig
from palpate.adapters.fault_injection.campaign.liars import liars
from palpate.adapters.fault_injection.campaign.runs import PHASES, TORQUE, Bench, FaultRun
from palpate.adapters.fault_injection.campaign.variants import Variant, variants
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import ConfigurationError
from palpate.core.supervision import SupervisionConfig
from palpate.core.trial import Phase, ReadyPose, find_ready_pose

GROUPS: Final = ("all", "devices", "liars")


@dataclass(frozen=True)
class Case:
    """One run to be made."""

    variant: Variant
    phase: Phase
    seed: int


@dataclass(frozen=True)
class Choice:
    """Which of all runs are to be made.

    Attributes:
        most: So many at most, spread evenly over all that the rest leaves; 0 for all.
        group: ``devices`` that fail, ``liars``, or ``all``.
        phase: Value of a phase; empty for all.
        fault: Part of the fault's name; empty for all.
    """

    most: int = 0
    group: str = GROUPS[0]
    phase: str = ""
    fault: str = ""


def all_variants(config: SupervisionConfig) -> list[Variant]:
    """Devices that fail, then sensors that lie. A fault's place here is part of what its ticks are drawn from."""
    return variants(config) + liars()


def cases(config: RunConfig, seeds: int, choice: Choice) -> list[Case]:
    """Every fault in every phase for every seed, or those that are chosen; sensors may also lie from the first tick on.

    Raises:
        ConfigurationError: Nothing is left.
    """
    failing = {variant.name for variant in variants(config.supervision)}
    every = [
        Case(variant, phase, seed)
        for seed in range(seeds)
        for variant in all_variants(config.supervision)
        for phase in (PHASES if variant.name in failing else (*PHASES, Phase.LIFT))
        if choice.group in (GROUPS[0], "devices" if variant.name in failing else "liars")
        and choice.phase in ("", phase.value)
        and choice.fault in variant.name
    ]
    if not every:
        accepted = f"part of the name of a fault in {choice.group}, such as {all_variants(config.supervision)[-1].name}"
        raise ConfigurationError("fault", choice.fault, accepted)
    most = choice.most
    if not most or most >= len(every):
        return every
    return [every[index] for index in np.linspace(0, len(every) - 1, most).round().astype(int)]


def run_cases(
    config: RunConfig,
    chosen: Sequence[Case],
    *,
    policy: str = TORQUE,
    rig_file: str,
    supervised: bool,
    jobs: int,
) -> Iterator[list[FaultRun]]:
    """Run them, seed by seed; results do not depend on the number of processes.

    Args:
        rig_file: The devices to run on, one trial after the other; the simulator if it is empty.
        supervised: False lets every command through.
    """
    ready = find_ready_pose(config.arm, config.task)
    by_seed: dict[int, list[Case]] = {}
    for case in chosen:
        by_seed.setdefault(case.seed, []).append(case)
    if rig_file or jobs == 1:
        yield from _on_one_rig(config, ready, list(by_seed.values()), policy, rig_file, supervised)
        return
    tasks = (delayed(_one_seed)(config, ready, own, policy, supervised) for own in by_seed.values())
    yield from Parallel(n_jobs=jobs, return_as="generator")(tasks)


def _on_one_rig(
    config: RunConfig, ready: ReadyPose, parts: Sequence[Sequence[Case]], policy: str, rig_file: str, supervised: bool
) -> Iterator[list[FaultRun]]:
    with ExitStack() as opened, open_rig(config, ready, rig_file) as rig:
        session = opened.enter_context(RealTimeSession(config.real_time)) if rig_file else None
        bench = Bench(config, ready, rig, supervised=supervised, session=session, policy=policy)
        for own in parts:
            windows = bench.windows(own[0].seed)
            for case in own:
                yield [_run(bench, case, windows)]


def _one_seed(
    config: RunConfig, ready: ReadyPose, own: Sequence[Case], policy: str, supervised: bool
) -> list[FaultRun]:
    with open_rig(config, ready, "") as rig:
        bench = Bench(config, ready, rig, supervised=supervised, policy=policy)
        windows = bench.windows(own[0].seed)
        return [_run(bench, case, windows) for case in own]


def _run(bench: Bench, case: Case, windows: dict[Phase, range]) -> FaultRun:
    window = windows.get(case.phase, range(1))
    names = [variant.name for variant in all_variants(bench.config.supervision)]
    place = (case.seed, names.index(case.variant.name), (*PHASES, Phase.LIFT).index(case.phase))
    tick = int(np.random.default_rng(np.random.SeedSequence(place)).integers(window.start, window.stop))
    return bench.run(case.variant, case.phase, tick, case.seed)
