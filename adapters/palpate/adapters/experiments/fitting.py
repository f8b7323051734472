"""Fit the perception to samples from random-walk trials."""

from collections.abc import Sequence

import numpy as np

from palpate.adapters.config import PerceptionConfig, RunConfig
from palpate.adapters.experiments.build import (
    build_perception,
    identifier,
    needs_fitting,
    plain_perception,
    task_actions,
)
from palpate.adapters.experiments.trial import require_sound
from palpate.adapters.experiments.trials import Trials
from palpate.adapters.mujoco import SimulatedRig
from palpate.core import perception
from palpate.core.policy import Action, Decision, Observation, RandomWalkPolicy
from palpate.core.ports import Rig
from palpate.core.trial import TRIALS_OF_A_SERIES, Purpose, ReadyPose, generator

FIRST_FITTING_TRIAL = 2 * TRIALS_OF_A_SERIES
"""Number of the first fitting trial, chosen so that random streams differ from those of a run."""


def configured_perception(config: RunConfig) -> perception.Perception | None:
    """Return the perception defined by the configuration, or None if it must be fitted."""
    return None if needs_fitting(config) else build_perception(config)


def fitted_perception(config: RunConfig, ready: ReadyPose, rig: Rig) -> perception.Perception:
    """Collect samples in random walks and fit the stages to them."""
    p = config.perception
    walk = _Recorder(task_actions(config))
    trials = Trials(config, ready, rig, plain_perception(config), walk)
    for k in range(p.fit_trials):
        require_sound(rig, trials.run(FIRST_FITTING_TRIAL + k))
    samples = walk.samples
    extractor = _extractor(p, samples, _seed(config, Purpose.FITTING))
    seed = _seed(config, Purpose.PARTITION)
    features = np.array([extractor.extract(tuple(row)) for row in samples])
    symboliser: perception.Symboliser
    if p.symbols == "random":
        low, high = features.min(axis=0), features.max(axis=0)
        bounds = {name: (float(a), float(b)) for name, a, b in zip(extractor.names, low, high, strict=True)}
        symboliser = perception.RandomPartition.draw(bounds, p.symbol_count, seed)
    else:
        symboliser = perception.Clusters.fit(features, p.symbol_count, seed, features=extractor.names)
    return perception.Perception(extractor, symboliser, identifier(p.memory, symboliser.symbols, task_actions(config)))


def simulated_perception(config: RunConfig, ready: ReadyPose) -> perception.Perception:
    """Return the configured perception; fitting, if necessary, takes place in the simulator."""
    found = configured_perception(config)
    if found is not None:
        return found
    with SimulatedRig(config, ready) as simulated:
        return fitted_perception(config, ready, simulated)


def _seed(config: RunConfig, purpose: Purpose) -> int:
    return int(generator(config.seed, purpose, 0).integers(2**31))


def _extractor(p: PerceptionConfig, samples: Sequence[tuple[float, ...]], seed: int) -> perception.FeatureExtractor:
    if p.features == "pca":
        return perception.PrincipalComponents.fit(samples, p.components, channels=p.channels)
    if p.features == "som":
        return perception.SelfOrganisingMap.fit(samples, p.som_side, p.som_side, seed, channels=p.channels)
    return perception.SelectedChannels(p.channels)


class _Recorder(RandomWalkPolicy):
    """A random walk that records its measurement vectors, in the order of ``CHANNELS``."""

    def __init__(self, actions: Sequence[Action]) -> None:
        super().__init__(actions)
        self.samples: list[tuple[float, ...]] = []

    def choose(self, observation: Observation) -> Decision:
        """Record the observation and choose a random action."""
        self.samples.append((*observation.position_m, *observation.force_N, *observation.torque_Nm))
        return super().choose(observation)
