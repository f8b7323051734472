"""Training of networks with a normalised hidden layer, many at once (see :mod:`palpate.core.automata.elman`).

What is trained are logarithms of shares: the share of a unit's content that goes to each unit, and to the end, after
an action. Tanh and sigmoid layers of any size learned of a world with places only what the last symbol tells, from some
hundred walks; these learn the places, for what they predict is what they feed back.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from typing_extensions import override

from palpate.core.automata.elman import LEAST, Network
from palpate.core.automata.restarts import Restarts, TreeLevel

if TYPE_CHECKING:
    from torch import Generator, Tensor

_PSEUDO_COUNT: Final = 0.02
"""Visits that every share is held to have had beforehand; 0 and 0.05 foretold held-out walks less well."""
_NO_END: Final = -30.0
"""In place of a logarithm: no string ends before its first symbol."""


class NormalisedRestarts(Restarts):
    """Parameters of R networks with a normalised hidden layer.

    Of ``output`` only the rows of the ends count; ``inputs`` and ``bias`` do not.
    """

    @override
    def hidden_states(
        self, levels: list[TreeLevel], *, noise: float = 0.0, generator: Generator | None = None
    ) -> Tensor:
        import torch

        hidden, count = self.architecture.hidden, len(self.architecture.names)
        each = hidden // count
        letters = torch.cat([level.symbols for level in levels])
        # Where a string is, only the units of its last symbol hold anything: of all weights one block a letter counts.
        now, before = letters % count, [torch.zeros_like(levels[0].symbols)]
        for above, level in pairwise(levels):
            before.append(above.symbols.index_select(0, level.parents) % count)
        shares = self._logarithms().exp()[:, :, :hidden].reshape(self.count, -1, each, count, each, count)
        blocks = shares.permute(0, 1, 5, 3, 2, 4).reshape(self.count, -1, each, each)
        taken = blocks.index_select(1, ((letters // count) * count + torch.cat(before)) * count + now)
        start = torch.softmax(self.parameters["start"], 1)
        held = torch.einsum("rasbt,rbt->rsa", shares[:, 0], start.reshape(self.count, each, count))
        fed_back, states = held.index_select(1, levels[0].symbols), list[torch.Tensor]()
        parts = torch.split(taken, [len(level.symbols) for level in levels], 1)
        for place, (level, weights) in enumerate(zip(levels, parts, strict=True)):
            if place:
                fed_back = (weights @ states[-1].index_select(1, level.parents).unsqueeze(3)).squeeze(3)
            if noise:
                fed_back = fed_back * (noise * torch.randn(fed_back.shape, generator=generator)).exp()
            states.append((fed_back + LEAST) / (fed_back + LEAST).sum(2, keepdim=True))
        held = torch.cat(states, 1).transpose(1, 2).unsqueeze(2)
        spread = (held * torch.nn.functional.one_hot(now, count).T).reshape(self.count, hidden, -1)
        return torch.cat((start.unsqueeze(2), spread), 2)

    @override
    def readings(self, hidden: Tensor, outcomes: slice = slice(None)) -> Tensor:
        import torch

        shape = self.architecture
        width = len(shape.names) + 1
        first, last, _ = outcomes.indices(shape.outcomes)
        shares = self._predicted(self._logarithms(1 + first // width, 1 + last // width).exp())
        return (torch.bmm(shares, hidden) + LEAST).log()

    @override
    def price(self, symbols: int) -> Tensor:
        return -_PSEUDO_COUNT / symbols * self._logarithms(1).flatten(1).sum(1)

    @override
    def network(self, place: int) -> Network:
        import torch

        shape, places = self.architecture, slice(place, place + 1)
        with torch.no_grad():
            shares = self._logarithms().exp()[places]
            output = self._predicted(shares[:, 1:])[0].numpy().astype(np.float64)
            start = torch.softmax(self.parameters["start"][place], 0).numpy().astype(np.float64)
            recurrent = shares[0, :, : shape.hidden].numpy().astype(np.float64)
        return Network(shape, recurrent, shape.kept, start, output, np.zeros(shape.outcomes))

    def _logarithms(self, first: int = 0, last: int | None = None) -> Tensor:
        """Logarithms of the shares of some matrices: to each unit and the end, from each, (R, matrices, h + 1, h)."""
        import torch

        recurrent, output = self.parameters["recurrent"], self.parameters["output"]
        ends = output.reshape(self.count, -1, len(self.architecture.names) + 1, self.architecture.hidden)[:, :, -1]
        ends = torch.cat((torch.full_like(ends[:, :1], _NO_END), ends), 1)
        return torch.log_softmax(torch.cat((recurrent, ends.unsqueeze(2)), 2)[:, first:last], 2)

    def _predicted(self, shares: Tensor) -> Tensor:
        """Weights from units to outcomes of some actions, (R, outcomes, h), of :meth:`_logarithms` without those."""
        import torch

        shape = self.architecture
        count = len(shape.names)
        sums = np.zeros((count + 1, shape.hidden + 1), dtype=np.float32)
        sums[:count, :-1], sums[-1, -1] = shape.kept[:count], 1.0
        return (torch.from_numpy(sums) @ shares).flatten(1, 2)
