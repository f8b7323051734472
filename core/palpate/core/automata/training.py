"""Parallel training of many restarts, using Adam and backpropagation through the prefix tree (paper, 3.4 and 5.3).

A single small network often converges to a poor minimum. Choosing the best of many cheap restarts helps more than a
better optimiser. For acceptance, the choice uses only the training strings. For prediction, held-out strings determine
the best version of each network and when training stops.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, TypeAlias

from palpate.core.automata.elman import Architecture, Network, Readout
from palpate.core.automata.restarts import Restarts, TrainingTask
from palpate.core.automata.strings import PrefixTree, Strings
from palpate.core.ports import Range, Settings

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSettings(Settings):
    """Settings for training the networks."""

    TABLE: ClassVar[str] = "training"

    restarts: Annotated[int, Range(1, 100_000)] = 64
    """Maximum number of networks to train."""
    batch: Annotated[int, Range(1, 4096)] = 64
    """Number of networks to train at once."""
    steps: Annotated[int, Range(0, 1_000_000)] = 500
    """Maximum number of steps per batch."""
    learning_rate: Annotated[float, Range(0.0, above=True)] = 0.1
    """Adam step size."""
    scale: Annotated[float, Range(0.0, above=True)] = 1.0
    """Standard deviation of the initial parameters."""
    clip: Annotated[float, Range(0.0, above=True)] = 1.0
    """Maximum gradient norm of a network."""
    enough: Annotated[int, Range(1, 100_000)] = 16
    """Stop once this many networks label every string correctly. For acceptance only."""
    flat_looks: Annotated[int, Range(0, 1_000_000)] = 4
    """End a batch when its lowest held-out loss has not fallen by 0.001 nats per symbol over this number of
    evaluations; 0 disables it. For prediction only."""
    look_every: Annotated[int, Range(1, 1_000_000)] = 25
    """Number of steps between loss evaluations."""
    seed: Annotated[int, Range(0, 2**32 - 1)] = 0
    """Random seed; the same seed always gives bit-identical networks."""


@dataclass(frozen=True, slots=True)
class Progress:
    """A point on the training curve.

    Attributes:
        best_loss: Lowest cross-entropy in the batch, in nats per symbol, on held-out strings if there are any; in nats
            per string for acceptance.
        consistent: Number of networks in all batches that label every training string correctly; 0 for prediction.
    """

    restart: int
    step: int
    best_loss: float
    consistent: int


_GAIN: Final = 0.001
"""Minimum improvement, in nats per symbol."""

OnProgress: TypeAlias = Callable[[Progress], None]


@dataclass(frozen=True, slots=True, eq=False)
class TrainedNetwork:
    """A network's best version during training, with its scores.

    Attributes:
        loss: Cross-entropy in nats per symbol, on held-out strings if there are any; in nats per string for acceptance.
        consistent: True if it labels every training string correctly; always False for prediction.
    """

    network: Network
    restart: int
    loss: float
    consistent: bool


@dataclass(frozen=True, slots=True, eq=False)
class Training:
    """Training results.

    Attributes:
        networks: All trained networks, at least one; consistent networks come first, then those with the lowest loss.
    """

    networks: tuple[TrainedNetwork, ...]
    curve: tuple[Progress, ...]

    @property
    def best(self) -> TrainedNetwork:
        """The best network, consistent or not."""
        return self.networks[0]

    @property
    def consistent(self) -> int:
        """Number of networks that label every training string correctly."""
        return sum(network.consistent for network in self.networks)

    @property
    def summary(self) -> str:
        """One-line summary of the results."""
        best, steps = self.best, max(point.step for point in self.curve)
        reading = best.network.architecture.reading
        unit = "symbol" if reading is Readout.PREDICTION else "string"
        reached = f"{len(self.networks)} networks, {steps} steps; lowest loss {best.loss:.4g} nats a {unit}"
        if reading is Readout.PREDICTION:
            return reached
        if self.consistent:
            return f"{reached}; {self.consistent} correct about every training string"
        return f"{reached}; none is correct about every training string"


def train(
    strings: Strings,
    architecture: Architecture,
    settings: TrainingSettings | None = None,
    progress: OnProgress | None = None,
    held_out: PrefixTree | None = None,
) -> Training:
    """Train networks on strings.

    Args:
        held_out: For prediction, strings that select each network's best version; None uses the training strings.
    """
    settings = settings or TrainingSettings()
    task = TrainingTask(PrefixTree.of(strings), architecture)
    judged = TrainingTask(held_out, architecture) if held_out is not None and not strings.labelled else None
    found: list[TrainedNetwork] = []
    curve: list[Progress] = []
    with _one_thread():
        while len(found) < settings.restarts and sum(network.consistent for network in found) < settings.enough:
            consistent = sum(network.consistent for network in found)
            batch = _Batch(architecture, settings, len(found), consistent, judged)
            for point in batch.run(task):
                curve.append(point)
                if progress is not None:
                    progress(point)
            found += batch.networks()
    found.sort(key=lambda network: (not network.consistent, network.loss))
    return Training(tuple(found), tuple(curve))


class _Batch:
    """A batch of restarts being trained, with the best version of each."""

    def __init__(
        self,
        architecture: Architecture,
        settings: TrainingSettings,
        first: int,
        consistent: int,
        judged: TrainingTask | None,
    ) -> None:
        import torch

        count = min(settings.batch, settings.restarts - first)
        self._settings, self._first, self._before, self._judged = settings, first, consistent, judged
        self._restarts = Restarts(architecture, count, seed=settings.seed, scale=settings.scale, skip=first)
        self._best = {name: value.detach().clone() for name, value in self._restarts.parameters.items()}
        self._losses = torch.full((count,), torch.inf)
        self._right = torch.zeros(count, dtype=torch.bool)

    def run(self, task: TrainingTask) -> Iterator[Progress]:
        """Train the batch and yield progress at each evaluation."""
        import torch

        settings, restarts = self._settings, self._restarts
        optimiser = torch.optim.Adam(restarts.parameters.values(), lr=settings.learning_rate)
        judged = task if self._judged is None else self._judged
        looks = [self._look(judged, 0)]
        yield looks[-1]
        for step in range(1, settings.steps + 1):
            optimiser.zero_grad()
            hidden = restarts.hidden_states(task.levels)
            losses, _ = task.losses(restarts, hidden)
            # The sum gives each network the gradient that it would have alone.
            losses.sum().backward()
            restarts.clip(settings.clip)
            optimiser.step()
            if step % settings.look_every == 0 or step == settings.steps:
                looks.append(self._look(judged, step))
                yield looks[-1]
                if looks[-1].consistent >= settings.enough or self._flat(looks):
                    return

    def _flat(self, looks: list[Progress]) -> bool:
        """Return True if the held-out loss has stopped improving."""
        few = self._settings.flat_looks
        if self._judged is None or not few or len(looks) <= few:
            return False
        before = min(look.best_loss for look in looks[:-few])
        return min(look.best_loss for look in looks[-few:]) > before - _GAIN

    def networks(self) -> list[TrainedNetwork]:
        """Return the best version of each network."""
        self._restarts.parameters = self._best
        return [
            TrainedNetwork(self._restarts.network(place), self._first + place, loss, right)
            for place, (loss, right) in enumerate(zip(self._losses.tolist(), self._right.tolist(), strict=True))
        ]

    def _look(self, task: TrainingTask, step: int) -> Progress:
        import torch

        with torch.no_grad():
            losses, right = task.losses(self._restarts, self._restarts.hidden_states(task.levels))
            right = torch.zeros_like(self._right) if right is None else right
            better = (right & ~self._right) | ((right == self._right) & (losses < self._losses))
            for name, value in self._restarts.parameters.items():
                self._best[name] = _chosen(better, value, self._best[name])
            self._losses = torch.where(better, losses, self._losses)
            self._right |= right
        return Progress(self._first, step, float(losses.min()), self._before + int(self._right.sum()))


def _chosen(better: Tensor, new: Tensor, old: Tensor) -> Tensor:
    import torch

    return torch.where(better.view(-1, *[1] * (new.dim() - 1)), new, old)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Limit torch to one thread; more would change the order of summation and thus the least significant bits."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
