"""The automaton in the insertion task: does the learner with memory do better than the plain one?

    python -m benchmarks.automata_insertion --scenario blind --seeds 4 --trials 350

For each seed: random walks in the work cell give symbol strings (those that ended in the hole and are not too long); an
automaton is inferred from them; Q-learning then has the same trials, settings and number of trials with each memory:
none (the 17 plain states), the last two symbols, the last three, the automaton, and an automaton of the same strings
whose states different symbols may lead into ("merged"). Seeds begin at 300. All but the torque
rule learn; it is beside them because it needs no memory and no learning. The paper's symbols tell the torque only where
both coordinates are within --position-mm of where the hole is believed to be; with a large one they tell it always.
With --back-off states with a memory act by their last symbol until they were tried about so often.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from palpate.adapters.config.run import PerceptionConfig, RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import comparator, learning_policy
from palpate.adapters.experiments.statistics import quantile_interval, shown_interval
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.automata.choice import ExtractionSettings
from palpate.core.automata.document import save
from palpate.core.automata.infer import InferenceSettings, infer
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import TrainingSettings
from palpate.core.policy import Policy
from palpate.core.trial import find_ready_pose

FIRST_SEED = 300
FIRST_WALK = 2_000_000
MEMORIES = ("none", "last-2", "last-3", "automaton", "merged")
LAST = 50


def walk_strings(config: RunConfig, walks: int, longest: int) -> Strings:
    """What random walks felt that ended in the hole."""
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    task = build_task(config, ready, perception, comparator("random", config, tuple))
    words = []
    with SimulatedRig(config, ready) as rig:
        for trial in range(walks):
            scored = run_scored_trial(config, rig, task, FIRST_WALK + trial)
            word = tuple(decision.symbol for decision in scored.report.decisions)
            if scored.success and 0 < len(word) <= longest:
                words.append(word)
    return Strings.of(words, alphabet=perception.symbols)


def trials_of(config: RunConfig, policy_of: str, trials: int) -> tuple[np.ndarray, np.ndarray]:
    """Exploration times and successes."""
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    policy: Policy
    policy = learning_policy(config, perception) if policy_of == "learn" else comparator(policy_of, config, tuple)
    task = build_task(config, ready, perception, policy)
    with SimulatedRig(config, ready) as rig:
        scored = [run_scored_trial(config, rig, task, trial) for trial in range(trials)]
    times = np.array([one.report.exploration_time_s for one in scored])
    return times, np.array([one.success for one in scored])


def one_seed(
    job: tuple[str, int, int, int, int, float, float],
) -> tuple[int, str, dict[str, tuple[np.ndarray, np.ndarray, int]]]:
    name, seed, trials, walks, longest, position_mm, back_off = job
    config = replace(scenario(name), seed=seed)
    config = replace(config, perception=replace(config.perception, position_threshold_mm=position_mm))
    config = replace(config, learning=replace(config.learning, back_off_visits=back_off))
    begin = time.perf_counter()
    strings = walk_strings(config, walks, longest)
    walked = time.perf_counter()
    settings = InferenceSettings(training=TrainingSettings(restarts=32, batch=32, seed=seed))
    found = {
        "automaton": infer(strings, settings),
        "merged": infer(strings, replace(settings, extraction=ExtractionSettings(merge_symbols=True))),
    }
    inferred = time.perf_counter()
    told = (
        f"seed {seed}: {len(strings.words)} strings of {walks} walks ({walked - begin:.0f} s), {strings.symbols}"
        f" symbols; inferred in {inferred - walked:.0f} s"
    )
    for kind, one in found.items():
        told += (
            f"\n  {kind}: q = {one.chosen.intervals}, {one.chosen.raw_states} cells, {one.chosen.states} states,"
            f" held-out loss {one.chosen.loss:.3f}"
        )
    results: dict[str, tuple[np.ndarray, np.ndarray, int]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for memory in MEMORIES:
            file = Path(folder) / f"{memory}.json"
            if memory in found:
                save(found[memory].machine, file)
            own = replace(config.perception, memory=str(file) if memory in found else memory)
            remembering = replace(config, perception=own)
            states = len(build_perception(remembering).states)
            results[memory] = (*trials_of(remembering, "learn", trials), states)
    results["torque rule"] = (*trials_of(config, "torque", min(trials, LAST)), 0)
    return seed, told, results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="blind")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--trials", type=int, default=350)
    parser.add_argument("--walks", type=int, default=200)
    parser.add_argument("--longest", type=int, default=200)
    parser.add_argument("--position-mm", type=float, default=PerceptionConfig().position_threshold_mm)
    parser.add_argument("--back-off", type=float, default=0.0, help="visits; 0 for never, as in the paper")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    jobs = [
        (options.scenario, seed, options.trials, options.walks, options.longest, options.position_mm, options.back_off)
        for seed in range(options.first_seed, options.first_seed + options.seeds)
    ]
    gathered: dict[str, list[tuple[np.ndarray, np.ndarray, int]]] = {}
    with Pool(options.jobs) as pool:
        for _, told, results in pool.imap(one_seed, jobs):
            print(told, flush=True)
            for memory, result in results.items():
                gathered.setdefault(memory, []).append(result)
                times, wins, states = result
                print(f"  {memory:<12} {states:5d} states: last {LAST} trials mean {times[-LAST:].mean():.2f} s,"
                      f" success {wins[-LAST:].mean():.0%}; all trials {times.mean():.2f} s", flush=True)  # fmt: skip
    print(f"\n{options.scenario}, {options.seeds} seeds, {options.trials} trials each; means of the last {LAST} trials")
    for memory, every in gathered.items():
        means = [float(times[-LAST:].mean()) for times, _, _ in every]
        median_s = shown_interval(float(np.median(means)), *(quantile_interval(means, 0.5) or (None, None)))
        wins = np.mean([own[-LAST:].mean() for _, own, _ in every])
        print(f"{memory:<12} median {median_s} s, success {wins:.1%}")


if __name__ == "__main__":
    main()
