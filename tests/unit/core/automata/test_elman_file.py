import json

import numpy as np
import pytest

from palpate.core.automata.elman import (
    Architecture,
    Network,
    Readout,
    load_network,
    network_from_dict,
    network_to_dict,
    save_network,
)
from palpate.core.errors import ConfigurationError, OutputError


def network(reading: Readout = Readout.PREDICTION, order: int = 1) -> Network:
    shape = Architecture(alphabet=("x- y0", "b"), reading=reading, hidden=3, activation="tanh", order=order)
    rng = np.random.default_rng(4)
    return Network(shape, **{name: rng.normal(size=size) for name, size in shape.shapes.items()})


@pytest.mark.parametrize("reading", list(Readout))
@pytest.mark.parametrize("order", [1, 2])
def test_a_network_comes_back_to_the_last_bit(tmp_path, reading, order) -> None:
    one = network(reading, order)
    save_network(one, tmp_path / "network.json")
    back = load_network(tmp_path / "network.json", ("x- y0", "b"))
    assert back.architecture == one.architecture
    for name in one.architecture.shapes:
        assert getattr(back, name).tobytes() == getattr(one, name).tobytes()
    save_network(back, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "network.json").read_bytes()


def test_another_alphabet_is_refused(tmp_path) -> None:
    save_network(network(), tmp_path / "network.json")
    with pytest.raises(ConfigurationError, match="the network's own: x- y0, b"):
        load_network(tmp_path / "network.json", ("b", "x- y0"))


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("schema", "palpate.elman/9", r"network\.schema"),
        ("reading", "mind", r"network\.reading = 'mind' is refused: one of prediction, acceptance"),
        ("alphabet", "ab", r"network\.alphabet"),
        ("hidden", 2.5, r"network\.hidden"),
        ("inputs", [[0.0]], r"network\.inputs"),
        ("more", 1, "network = .*keys schema"),
    ],
)
def test_bad_values_are_refused(key, value, said) -> None:
    with pytest.raises(ConfigurationError, match=said):
        network_from_dict(network_to_dict(network()) | {key: value})


@pytest.mark.parametrize("key", ["alphabet", "reading", "inputs"])
def test_missing_keys_are_refused(key) -> None:
    data = network_to_dict(network())
    del data[key]
    with pytest.raises(ConfigurationError, match=key):
        network_from_dict(data)


@pytest.mark.parametrize("data", [None, [], "text"])
def test_other_things_are_refused(data) -> None:
    with pytest.raises(ConfigurationError, match=r"network\.schema"):
        network_from_dict(data)


def test_files_that_are_none(tmp_path) -> None:
    with pytest.raises(ConfigurationError, match="a readable file"):
        load_network(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{")
    with pytest.raises(ConfigurationError, match="a JSON file"):
        load_network(tmp_path / "bad.json")
    with pytest.raises(OutputError):
        save_network(network(), tmp_path / "no" / "place.json")


def test_values_of_a_wrong_kind_are_refused() -> None:
    data = json.loads(json.dumps(network_to_dict(network())))
    for values in ("text", [["a", "b", "c"]] * 2, None):
        with pytest.raises(ConfigurationError, match=r"network\.inputs"):
            network_from_dict(data | {"inputs": values})
