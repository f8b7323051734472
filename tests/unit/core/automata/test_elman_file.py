import json

import numpy as np
import pytest

from palpate.core.automata.elman import Architecture, Network, Readout, network_to_dict, save_network


def network(reading: Readout = Readout.PREDICTION, order: int = 1) -> Network:
    shape = Architecture(alphabet=("x- y0", "b"), reading=reading, hidden=3, activation="tanh", order=order)
    rng = np.random.default_rng(4)
    return Network(shape, **{name: rng.normal(size=size) for name, size in shape.shapes.items()})


@pytest.mark.parametrize("reading", list(Readout))
@pytest.mark.parametrize("order", [1, 2])
def test_the_file_has_the_shape_and_every_weight_to_the_last_bit(tmp_path, reading, order) -> None:
    one = network(reading, order)
    save_network(one, tmp_path / "network.json")
    data = json.loads((tmp_path / "network.json").read_text())
    assert data == network_to_dict(one)
    shape = {"schema": "palpate.elman/1", "alphabet": ["x- y0", "b"], "reading": reading.value, "hidden": 3}
    shape |= {"activation": "tanh", "order": order}
    assert {key: data.pop(key) for key in shape} == shape
    for name, values in data.items():
        assert np.array(values).tobytes() == getattr(one, name).tobytes()
    assert set(data) == set(one.architecture.shapes)
