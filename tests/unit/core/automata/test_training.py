import numpy as np
import pytest

from palpate.core.automata import Architecture, Readout, Strings
from palpate.core.automata.training import Progress, Training, TrainingSettings, train
from palpate.core.errors import ConfigurationError

BINARY = ("0", "1")
EVEN_ONES = Strings.of(
    [f"{n:0{length}b}" if length else "" for length in range(6) for n in range(2**length)],
    [n.bit_count() % 2 == 0 for length in range(6) for n in range(2**length)],
)
ACCEPTOR = Architecture(alphabet=BINARY, reading=Readout.ACCEPTANCE, order=2)
PREDICTOR = Architecture(alphabet=("a", "b"), reading=Readout.PREDICTION)
WALKS = Strings.of(["ab", "abab", "ab", "aab"])


def parameters(training: Training) -> list[bytes]:
    return [getattr(t.network, name).tobytes() for t in training.networks for name in t.network.architecture.shapes]


def test_equal_seeds_give_equal_bytes_and_others_do_not() -> None:
    settings = TrainingSettings(restarts=6, batch=4, steps=30, noise=0.2, look_every=7)
    one, again = train(WALKS, PREDICTOR, settings), train(WALKS, PREDICTOR, settings)
    assert parameters(one) == parameters(again)
    assert one.curve == again.curve
    other = train(WALKS, PREDICTOR, TrainingSettings(restarts=6, batch=4, steps=30, noise=0.2, look_every=7, seed=1))
    assert parameters(one) != parameters(other)


def test_the_threads_of_the_caller_are_left_as_they_were() -> None:
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        train(WALKS, PREDICTOR, TrainingSettings(restarts=2, batch=2, steps=1))
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


def test_batches_are_counted_on_and_progress_is_told() -> None:
    told: list[Progress] = []
    training = train(WALKS, PREDICTOR, TrainingSettings(restarts=5, batch=2, steps=10, look_every=4), told.append)
    assert [(point.restart, point.step) for point in told] == [(r, s) for r in (0, 2, 4) for s in (0, 4, 8, 10)]
    assert training.curve == tuple(told)
    assert sorted(network.restart for network in training.networks) == [0, 1, 2, 3, 4]
    assert all(point.best_loss <= point.median_loss and point.consistent == 0 for point in told)
    assert "5 networks, 10 steps; lowest loss" in training.summary


def test_the_best_is_kept_even_if_none_is_consistent() -> None:
    # A step size that throws every network about: what was best is far from what is last.
    wild = TrainingSettings(restarts=4, batch=4, steps=40, learning_rate=30.0, look_every=1)
    training = train(EVEN_ONES, ACCEPTOR, wild)
    assert training.consistent == 0
    assert training.best.loss == min(point.best_loss for point in training.curve)
    assert training.curve[-1].best_loss > training.best.loss
    assert "none is right about every training string" in training.summary


def test_no_more_batches_than_needed() -> None:
    training = train(EVEN_ONES, ACCEPTOR, TrainingSettings(restarts=320, batch=32, steps=400, enough=2))
    assert len(training.networks) < 320
    assert training.consistent >= 2
    losses = [network.loss for network in training.networks[: training.consistent]]
    assert losses == sorted(losses)


def test_training_lowers_the_loss_to_that_of_the_source() -> None:
    # After an a comes a b with 3 in 4, an a otherwise; after a b the end.
    training = train(Strings.of(["ab"] * 3 + ["aab"]), PREDICTOR, TrainingSettings(restarts=8, batch=8, steps=300))
    choices = 3 * np.log(4 / 3) + np.log(4.0)
    assert training.best.loss == pytest.approx(choices / 13, abs=0.01)


@pytest.mark.parametrize(
    ("strings", "shape", "said"),
    [
        (WALKS, ACCEPTOR, r"network\.alphabet"),
        (WALKS, Architecture(alphabet=("a", "b"), reading=Readout.ACCEPTANCE), "prediction for such strings"),
        (EVEN_ONES, Architecture(alphabet=BINARY, reading=Readout.PREDICTION), "acceptance for such strings"),
    ],
)
def test_strings_must_suit_the_network(strings, shape, said) -> None:
    with pytest.raises(ConfigurationError, match=said):
        train(strings, shape)
