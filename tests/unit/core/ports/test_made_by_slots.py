"""Frozen dataclasses that set their slots themselves are made as before, and stay frozen and checked."""

import inspect
import pickle
from dataclasses import FrozenInstanceError, dataclass, replace

import pytest

from palpate.core.ports.values import made_by_slots


@made_by_slots
@dataclass(frozen=True, slots=True)
class _Length:
    length_m: float
    name: str = "edge"

    def __post_init__(self) -> None:
        if self.length_m < 0.0:
            raise ValueError("a length is not negative")


@made_by_slots
@dataclass(frozen=True, slots=True)
class _Unchecked:
    x: int


def test_made_by_place_name_and_default() -> None:
    assert _Length(1.0) == _Length(length_m=1.0, name="edge") == _Length(1.0, "edge") != _Length(1.0, "face")
    assert _Unchecked(3).x == 3


def test_stays_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        _Length(1.0).length_m = 2.0  # type: ignore[misc]


def test_is_checked_whenever_it_is_made() -> None:
    with pytest.raises(ValueError, match="not negative"):
        _Length(-1.0)
    with pytest.raises(ValueError, match="not negative"):
        replace(_Length(1.0), length_m=-1.0)


def test_a_missing_or_unknown_field_is_refused_by_name() -> None:
    with pytest.raises(TypeError, match="length_m"):
        _Length()  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="width_m"):
        _Length(1.0, width_m=2.0)  # type: ignore[call-arg]


def test_signature_copies_and_pickles_are_those_of_a_dataclass() -> None:
    assert list(inspect.signature(_Length).parameters) == ["length_m", "name"]
    assert replace(_Length(1.0), name="face") == _Length(1.0, "face")
    assert pickle.loads(pickle.dumps(_Length(1.0))) == _Length(1.0)
    assert hash(_Length(1.0)) == hash(_Length(1.0))
