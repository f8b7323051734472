"""All faults in all phases, over seeds: in lock-step in the simulator, or on a rig in real time."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final

import numpy as np

from palpate.adapters.config import RunConfig, task_kind
from palpate.adapters.experiments import in_processes, open_rig, ready_pose
from palpate.adapters.fault_injection.campaign.liars import liars
from palpate.adapters.fault_injection.campaign.runs import Bench, FaultRun
from palpate.adapters.fault_injection.campaign.variants import Variant, variants
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import ConfigurationError
from palpate.core.supervision import SupervisionConfig
from palpate.core.trial import Phase, ReadyPose

GROUPS: Final = ("all", "devices", "liars")


@dataclass(frozen=True)
class Case:
    """One run to be made."""

    variant: Variant
    phase: str
    seed: int


@dataclass(frozen=True)
class Choice:
    """Which of all runs are to be made.

    Attributes:
        most: So many at most, spread evenly over all that the rest leaves; 0 for all.
        group: ``devices`` that fail, ``liars``, or ``all``.
        phase: Name of one of the task's phases; empty for all.
        fault: Part of the fault's name; empty for all.
    """

    most: int = 0
    group: str = GROUPS[0]
    phase: str = ""
    fault: str = ""


def phases_of(config: RunConfig) -> tuple[str, ...]:
    """Names of the phases in which a fault can strike in every trial of the task."""
    return tuple(str(phase.value) for phase in task_kind(config.task.name).phases)


def all_variants(config: SupervisionConfig) -> list[Variant]:
    """Devices that fail, then sensors that lie. A fault's place here is part of what its ticks are drawn from."""
    return variants(config) + liars()


def cases(config: RunConfig, seeds: int, choice: Choice) -> list[Case]:
    """Every fault in every phase for every seed, or those that are chosen; sensors may also lie from the first tick on.

    Raises:
        ConfigurationError: Nothing is left.
    """
    phases, first = phases_of(config), Phase.LIFT.value
    if choice.phase not in ("", first, *phases):
        raise ConfigurationError("phase", choice.phase, f"one of {first}, {', '.join(phases)}")
    failing = {variant.name for variant in variants(config.supervision)}
    every = [
        Case(variant, phase, seed)
        for seed in range(seeds)
        for variant in all_variants(config.supervision)
        for phase in (phases if variant.name in failing else (*phases, first))
        if choice.group in (GROUPS[0], "devices" if variant.name in failing else "liars")
        and choice.phase in ("", phase)
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
    policy: str,
    rig_file: str,
    supervised: bool,
    jobs: int,
) -> Iterator[list[FaultRun]]:
    """Run them, seed by seed; results do not depend on the number of processes.

    Args:
        rig_file: The devices to run on, one trial after the other; the simulator if it is empty.
        supervised: False lets every command through.
    """
    ready = ready_pose(config)
    by_seed: dict[int, list[Case]] = {}
    for case in chosen:
        by_seed.setdefault(case.seed, []).append(case)
    if rig_file or jobs == 1:
        yield from _on_one_rig(config, ready, list(by_seed.values()), policy, rig_file, supervised)
        return
    yield from in_processes(_one_seed, ((config, ready, own, policy, supervised) for own in by_seed.values()), jobs)


def _on_one_rig(
    config: RunConfig, ready: ReadyPose, parts: Sequence[Sequence[Case]], policy: str, rig_file: str, supervised: bool
) -> Iterator[list[FaultRun]]:
    with ExitStack() as opened, open_rig(config, ready, rig_file) as rig:
        session = opened.enter_context(RealTimeSession(config.real_time)) if rig_file else None
        bench = Bench(config, ready, rig, supervised=supervised, session=session, policy=policy)
        for own in parts:
            phases = bench.ticks(own[0].seed)
            for case in own:
                yield [_run(bench, case, phases)]


def _one_seed(
    config: RunConfig, ready: ReadyPose, own: Sequence[Case], policy: str, supervised: bool
) -> list[FaultRun]:
    with open_rig(config, ready, "") as rig:
        bench = Bench(config, ready, rig, supervised=supervised, policy=policy)
        phases = bench.ticks(own[0].seed)
        return [_run(bench, case, phases) for case in own]


def _run(bench: Bench, case: Case, phases: Mapping[str, Sequence[int]]) -> FaultRun:
    ticks = phases.get(case.phase) or (0,)
    names = [variant.name for variant in all_variants(bench.config.supervision)]
    place = (case.seed, names.index(case.variant.name), (*phases_of(bench.config), Phase.LIFT.value).index(case.phase))
    index = int(np.random.default_rng(np.random.SeedSequence(place)).integers(len(ticks)))
    return bench.run(case.variant, case.phase, ticks[index], case.seed)
