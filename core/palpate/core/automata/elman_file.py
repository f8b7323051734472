"""Elman networks on disk: plain JSON with the alphabet, and floats that come back to the last bit."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Final

from palpate.core.automata.elman import Architecture, Network, Reading
from palpate.core.errors import ConfigurationError, OutputError

SCHEMA: Final = "palpate.elman/1"
_SHAPE: Final = ("alphabet", "reading", "hidden", "activation", "order")


def network_to_dict(network: Network) -> dict[str, Any]:
    """Write a network as plain JSON values."""
    shape = network.architecture
    about = {"alphabet": list(shape.alphabet), "reading": shape.reading.value, "hidden": shape.hidden}
    about |= {"activation": shape.activation, "order": shape.order}
    return {"schema": SCHEMA, **about, **{name: getattr(network, name).tolist() for name in shape.shapes}}


def network_from_dict(data: object, alphabet: tuple[str, ...] | None = None) -> Network:
    """Read what :func:`network_to_dict` wrote.

    Args:
        data: Plain values.
        alphabet: The alphabet that is expected, in order; None takes any.

    Raises:
        ConfigurationError: Another schema or alphabet, a key is missing or too many, or a value is wrong.
    """
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        found = data.get("schema") if isinstance(data, dict) else data
        raise ConfigurationError("network.schema", found, repr(SCHEMA))
    for key in _SHAPE:
        if key not in data:
            raise ConfigurationError(f"network.{key}", "missing", f"keys {', '.join(_SHAPE)} and the parameters")
    try:
        reading = Reading(data["reading"])
    except ValueError as error:
        accepted = f"one of {', '.join(reading.value for reading in Reading)}"
        raise ConfigurationError("network.reading", data["reading"], accepted) from error
    names = data["alphabet"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ConfigurationError("network.alphabet", names, "a list of names")
    shape = Architecture(
        alphabet=tuple(names),
        reading=reading,
        hidden=data["hidden"],
        activation=data["activation"],
        order=data["order"],
    )
    if set(data) != {"schema", *_SHAPE, *shape.shapes}:
        raise ConfigurationError("network", sorted(data), f"keys schema, {', '.join((*_SHAPE, *shape.shapes))}")
    network = Network(shape, **{name: data[name] for name in shape.shapes})
    if alphabet is not None:
        network.require_alphabet(alphabet)
    return network


def save_network(network: Network, path: str | os.PathLike[str]) -> None:
    """Write a network file; an older one of the name is replaced.

    Raises:
        OutputError: The place cannot be written to.
    """
    text = json.dumps(network_to_dict(network), indent=1, allow_nan=False) + "\n"
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(str(path), f"cannot be written ({error.strerror})", "choose another place") from error


def load_network(path: str | os.PathLike[str], alphabet: tuple[str, ...] | None = None) -> Network:
    """Read a network file.

    Args:
        path: The file.
        alphabet: The alphabet that is expected, in order; None takes any.

    Raises:
        ConfigurationError: No such file, not one that :func:`save_network` wrote, or another alphabet.
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError("network.file", str(path), f"a readable file ({error.strerror})") from error
    except ValueError as error:
        raise ConfigurationError("network.file", str(path), "a JSON file from save_network") from error
    return network_from_dict(data, alphabet)
