"""An adapter for a TorchScript or ONNX network that maps a measurement to a value for each action.

    POLICY_NETWORK=net.pt palpate run --rig rig.toml --policy third_party_policies.network:Network
    POLICY_NETWORK=net.onnx palpate run --rig rig.toml --policy third_party_policies.network:Network

The network takes (position x y z, reference x y z, force x y z, torque x y z) in mm, N and N mm as a float32 tensor of
shape (12,), or (1, 12) if an ONNX file requires it. It returns a value for each action; the highest one is selected.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from palpate.core.policy import Decision, Observation, Policy, PolicyContext, Transition


def torch_script(path: str) -> Callable[[Sequence[float]], list[float]]:
    """Return a function that computes the action values with a TorchScript file."""
    import torch

    torch.set_num_threads(1)  # sums in one order: equal input, equal bits
    network = torch.jit.load(path).eval()  # type: ignore[no-untyped-call]

    def values(measured: Sequence[float]) -> list[float]:
        with torch.inference_mode():
            found: list[float] = network(torch.tensor(measured, dtype=torch.float32)).flatten().tolist()
        return found

    return values


def onnx(path: str) -> Callable[[Sequence[float]], list[float]]:
    """Return a function that computes the action values with an ONNX file."""
    try:
        import onnxruntime
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{path} needs onnxruntime: pip install onnxruntime", name=error.name) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    (given,) = session.get_inputs()
    shape = (1, -1) if len(given.shape) == 2 else (-1,)

    def values(measured: Sequence[float]) -> list[float]:
        (found, *_) = session.run(None, {given.name: np.array(measured, np.float32).reshape(shape)})
        flat: list[float] = np.asarray(found).ravel().tolist()
        return flat

    return values


class Network(Policy):
    """A non-learning policy that chooses the action with the highest value in the network ``POLICY_NETWORK``."""

    temperature = None

    def __init__(self, context: PolicyContext) -> None:
        self._actions = context.actions
        path = os.environ["POLICY_NETWORK"]
        self._digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()
        self._values = onnx(path) if path.endswith(".onnx") else torch_script(path)
        for _ in range(3):
            # The first calls compile, which takes longer than an arm waits.
            self._values((0.0,) * 12)

    def serves(self, state: int) -> bool:
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Do nothing, because the policy has no memory and no randomness."""

    def choose(self, observation: Observation) -> Decision:
        lengths = (*observation.position_m, *observation.reference_m)
        measured = (*(1e3 * x for x in lengths), *observation.force_N, *(1e3 * t for t in observation.torque_Nm))
        values = self._values(measured)
        best = values.index(max(values))
        return Decision(self._actions[best], best, "network")

    def learn(self, transition: Transition) -> None:
        """Do nothing, because this policy does not learn."""

    def get_state(self) -> dict[str, Any]:
        """Return the digest of the network file, so that a replay with a different network is rejected."""
        return {"sha256": self._digest}

    def set_state(self, state: Mapping[str, Any]) -> None:
        if state["sha256"] != self._digest:
            raise ValueError("POLICY_NETWORK names another network than the one of this log or policy file")
