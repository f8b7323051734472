"""Networks with the same architecture, stored as one batch of parameters and evaluated together over a prefix tree.

Every restart is trained on all strings at once. The tree shares the strings' common prefixes, and a batch of small
matrix products takes barely longer than a single one. Training a network in a batch therefore costs about a fortieth of
the time it takes alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from palpate.core.automata.elman import Architecture, Network, Readout
from palpate.core.automata.strings import UNLABELLED, PrefixTree

if TYPE_CHECKING:
    from torch import Tensor

_AT_ONCE: Final = 2048
"""Number of nodes whose outputs are computed at once; the outputs of about ten thousand nodes do not fit in the
cache."""


@dataclass(frozen=True, slots=True)
class TreeLevel:
    """Nodes at one depth: the indices of their parents in the previous level, their last symbols, and their blocks.

    A block consists of a symbol, the first node that it leads to, and the node after the last one.
    """

    parents: Tensor
    symbols: Tensor
    blocks: tuple[tuple[int, int, int], ...]


class Restarts:
    """Parameters for R networks, (R, ...) each, drawn from a normal distribution.

    Network r depends on the seed and r alone, not on the number of networks. The first ``skip`` networks are omitted.
    """

    def __init__(self, architecture: Architecture, count: int, *, seed: int, scale: float = 1.0, skip: int = 0) -> None:
        import torch

        self.architecture, self.count = architecture, count
        sizes = {name: int(np.prod(shape)) for name, shape in architecture.shapes.items()}
        rng = np.random.default_rng(seed)
        drawn = scale * rng.standard_normal((skip + count, sum(sizes.values())))[skip:]
        ends = np.cumsum(list(sizes.values()))
        self.parameters: dict[str, Tensor] = {
            name: torch.tensor(part.reshape(count, *shape), dtype=torch.float32, requires_grad=True)
            for (name, shape), part in zip(architecture.shapes.items(), np.split(drawn, ends[:-1], axis=1), strict=True)
        }

    def hidden_states(self, levels: list[TreeLevel]) -> Tensor:
        """Return the hidden states at all nodes, (R, h, n)."""
        import torch

        activate = torch.tanh if self.architecture.activation == "tanh" else torch.sigmoid
        inputs = self.parameters["inputs"].transpose(1, 2)
        states = [activate(self.parameters["start"]).unsqueeze(2)]
        for level in levels:
            states.append(activate(self._drives(states[-1], level, inputs)))
        return torch.cat(states, 2)

    def readings(self, hidden: Tensor) -> Tensor:
        """Return the outputs, (R, k, n), before the output function is applied, for hidden states, (R, h, n)."""
        import torch

        return torch.baddbmm(self.parameters["bias"].unsqueeze(2), self.parameters["output"], hidden)

    def clip(self, most: float) -> None:
        """Clip each network's gradient norm to ``most``; set non-finite values to 0."""
        import torch

        with torch.no_grad():
            gradients = [p.grad for p in self.parameters.values() if p.grad is not None]
            lengths = torch.stack([(g * g).flatten(1).sum(1) for g in gradients]).sum(0).sqrt()
            factors = torch.where(lengths > most, most / lengths, torch.ones_like(lengths))
            for gradient in gradients:
                gradient.mul_(factors.view(-1, *[1] * (gradient.dim() - 1))).nan_to_num_(0.0, 0.0, 0.0)

    def network(self, place: int) -> Network:
        """Return one network from the batch."""
        values = {
            name: parameter[place].detach().numpy().astype(np.float64) for name, parameter in self.parameters.items()
        }
        return Network(self.architecture, **values)

    def _drives(self, before: Tensor, level: TreeLevel, inputs: Tensor) -> Tensor:
        import torch

        recurrent = self.parameters["recurrent"]
        if self.architecture.order == 1:
            shared = torch.bmm(recurrent[:, 0], before)
            return shared.index_select(2, level.parents) + inputs.index_select(2, level.symbols)
        parts = [
            torch.baddbmm(
                inputs[:, :, symbol].unsqueeze(2),
                recurrent[:, symbol],
                before.index_select(2, level.parents[low:high]),
            )
            for symbol, low, high in level.blocks
        ]
        return torch.cat(parts, 2)


def levels_of(tree: PrefixTree) -> list[TreeLevel]:
    """Convert a prefix tree to the form that :meth:`Restarts.hidden_states` expects."""
    import torch

    found, before = [], 0
    for blocks in tree.blocks():
        first, last = blocks[0][1], blocks[-1][2]
        parents, symbols = tree.parents[first:last] - before, tree.symbols[first:last]
        placed = tuple((symbol, low - first, high - first) for symbol, low, high in blocks)
        found.append(TreeLevel(torch.from_numpy(parents), torch.from_numpy(symbols), placed))
        before = first
    return found


class TrainingTask:
    """Training objective: the loss and, for acceptance, whether all strings are labelled correctly.

    Args:
        tree: The strings. For prediction, a node is weighted by the strings that pass through it; for acceptance, by
            those that end there.
    """

    def __init__(self, tree: PrefixTree, architecture: Architecture) -> None:
        import torch

        self.reading, self.levels = architecture.reading, levels_of(tree)
        self._parts: list[tuple[Tensor, Tensor]] = []
        if self.reading is Readout.PREDICTION:
            weights = tree.counts / tree.counts.sum()
            for nodes in torch.split(torch.arange(len(weights)), _AT_ONCE):
                counts = torch.from_numpy(weights[nodes.numpy()].T.copy()).to(torch.float32)
                self._parts.append((nodes, counts))
            return
        ended = np.flatnonzero(tree.labels != UNLABELLED)
        ends = tree.counts[ended, -1]
        self._nodes = torch.from_numpy(ended)
        self._labels = torch.from_numpy(tree.labels[ended]).to(torch.float32)
        self._weights = torch.from_numpy(ends / ends.sum()).to(torch.float32)

    def losses(self, restarts: Restarts, hidden: Tensor) -> tuple[Tensor, Tensor | None]:
        """Return the cross-entropy of each network, (R,), in nats per symbol, or per string for acceptance.

        For acceptance, also return a boolean array, (R,), that is True for networks that label every string correctly.
        """
        import torch

        if self.reading is Readout.PREDICTION:
            losses = torch.zeros(restarts.count)
            for nodes, counts in self._parts:
                drives = restarts.readings(hidden.index_select(2, nodes))
                chosen = torch.tensordot(drives, counts, dims=([1, 2], [0, 1]))
                losses = losses + torch.mv(drives.logsumexp(1), counts.sum(0)) - chosen
            return losses, None
        drives = restarts.readings(hidden.index_select(2, self._nodes))[:, 0]
        entropies = torch.nn.functional.binary_cross_entropy_with_logits(
            drives, self._labels.expand_as(drives), reduction="none"
        )
        right = ((drives > 0.0) == (self._labels > 0.5)).all(1)
        return torch.mv(entropies, self._weights), right
