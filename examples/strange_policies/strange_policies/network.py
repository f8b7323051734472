"""An adapter for a network: a TorchScript file that gives, for what is felt, a value for each action of the set.

    STRANGE_NETWORK=net.pt palpate run --rig rig.toml --policy strange_policies.network:Network

The network takes (position x y z, reference x y z, force x y z, torque x y z) in mm, N and N mm as a float32 tensor of
shape (12,), and gives a tensor of shape (actions,); the greatest value is taken.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch

from palpate.core.policy import Decision, Observation, Policy, PolicyContext, Transition


class Network(Policy):
    """Chooses what the network of the file ``STRANGE_NETWORK`` values most; it does not learn."""

    temperature = None

    def __init__(self, context: PolicyContext) -> None:
        self._actions = context.actions
        content = Path(os.environ["STRANGE_NETWORK"]).read_bytes()
        self._digest = hashlib.sha256(content).hexdigest()
        torch.set_num_threads(1)  # sums in one order: equal input, equal bits
        self._network = torch.jit.load(os.environ["STRANGE_NETWORK"]).eval()  # type: ignore[no-untyped-call]
        for _ in range(3):
            # The first calls compile, which takes longer than an arm waits.
            self._values((0.0,) * 12)

    def _values(self, felt: tuple[float, ...]) -> list[float]:
        with torch.inference_mode():
            values: list[float] = self._network(torch.tensor(felt, dtype=torch.float32)).tolist()
        return values

    def serves(self, state: int) -> bool:
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """It forgets nothing and draws nothing."""

    def choose(self, observation: Observation) -> Decision:
        lengths = (*observation.position_m, *observation.reference_m)
        felt = (*(1e3 * x for x in lengths), *observation.force_N, *(1e3 * t for t in observation.torque_Nm))
        values = self._values(felt)
        best = values.index(max(values))
        return Decision(self._actions[best], best, "network")

    def learn(self, transition: Transition) -> None:
        """It does not learn."""

    def get_state(self) -> dict[str, Any]:
        """The file's digest: a log is then replayed by this network, or refused."""
        return {"sha256": self._digest}

    def set_state(self, state: Mapping[str, Any]) -> None:
        if state["sha256"] != self._digest:
            raise ValueError("STRANGE_NETWORK names another network than the one of this log or policy file")
