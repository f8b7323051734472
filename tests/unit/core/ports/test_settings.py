"""What a declared setting accepts, in which form it is kept, and what a refusal says."""

from dataclasses import dataclass, replace
from math import inf, nan
from typing import Annotated, Any, ClassVar

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.ports.settings import Holds, OneOf, Range, Settings, accepted_by, fitted


@dataclass(frozen=True)
class Drill(Settings):
    """An example."""

    TABLE: ClassVar[str] = "cell.drill"

    depth_mm: Annotated[float, Range(0.5, 20.0, "mm")] = 10.0
    turns: Annotated[int, Range(1, 9)] = 2
    shape: Annotated[str, OneOf("round", "square")] = "round"
    cooled: bool = False
    name: str = ""
    lamps: tuple[Annotated[str, OneOf("a", "b")], ...] = ()
    offsets: tuple[float, float] = (0.0, 0.0)
    labels: dict[str, str] = None  # type: ignore[assignment]
    limit_N: Annotated[float, Range(0.0, above=True)] | None = None

    def __post_init__(self) -> None:
        if self.labels is None:
            object.__setattr__(self, "labels", {})
        super().__post_init__()

    def check(self) -> None:
        if self.turns > self.depth_mm:
            raise ConfigurationError(self.dotted("turns"), self.turns, "at most depth_mm")


@pytest.mark.parametrize(
    ("field", "value", "accepted"),
    [
        ("depth_mm", 0.4999, "a number from 0.5 to 20"),
        ("depth_mm", 20.001, "a number from 0.5 to 20"),
        ("depth_mm", nan, "a number from 0.5 to 20"),
        ("depth_mm", -inf, "a number from 0.5 to 20"),
        ("depth_mm", 10**400, "a number from 0.5 to 20"),
        ("depth_mm", "wide", "a number from 0.5 to 20"),
        ("depth_mm", True, "a number from 0.5 to 20"),
        ("depth_mm", None, "a number from 0.5 to 20"),
        ("turns", 0, "a whole number from 1 to 9"),
        ("turns", 2.0, "a whole number from 1 to 9"),
        ("turns", True, "a whole number from 1 to 9"),
        ("shape", "Round", "one of round, square; did you mean round?"),
        ("shape", "zzz", "one of round, square"),
        ("shape", 3, "one of round, square"),
        ("cooled", 1, "true or false"),
        ("name", 1, "a text"),
        ("lamps", "ab", "a list, each one of a, b"),
        ("offsets", [1.0], "a list of 2 numbers"),
        ("labels", [1], "a table"),
        ("limit_N", 0.0, "a number above 0"),
        ("limit_N", "none", "a number above 0"),
    ],
)
def test_a_refusal_names_setting_value_and_what_would_be_right(field: str, value: Any, accepted: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        Drill(**{field: value})
    error = caught.value
    assert (error.field, error.accepted) == (f"cell.drill.{field}", accepted)
    assert error.value is value
    with pytest.raises(ConfigurationError, match="is refused"):
        replace(Drill(), **{field: value})


@pytest.mark.parametrize(
    ("field", "value", "place"),
    [
        ("lamps", ("a", "c"), "lamps[1]"),
        ("offsets", (1.0, nan), "offsets[1]"),
        ("labels", {"x": 3}, "labels.x"),
    ],
)
def test_what_is_wrong_in_a_list_or_table_is_named_by_its_place(field: str, value: Any, place: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        Drill(**{field: value})
    assert caught.value.field == f"cell.drill.{place}"


def test_values_are_kept_in_one_form() -> None:
    drill = Drill(depth_mm=np.float64(7), offsets=[1, 2], lamps=["a"], limit_N=3)  # type: ignore[arg-type]
    assert drill == Drill(depth_mm=7.0, offsets=(1.0, 2.0), lamps=("a",), limit_N=3.0)
    kept = (drill.depth_mm, drill.offsets[0], drill.limit_N)
    assert [type(value) for value in kept] == [float, float, float]
    assert isinstance(drill.offsets, tuple)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (Annotated[float, Range()], "a finite number"),
        (Annotated[float, Range(0.0)], "a number from 0 up"),
        (Annotated[int, Range(0)], "a whole number from 0 up"),
        (Annotated[float, Range(0.0, 70.0, above=True, below=True)], "a number above 0 and below 70"),
        (Annotated[float, Range(0.0, 1.0, above=True)], "a number above 0 and at most 1"),
        (Annotated[float, Range(0.0, 1.0, below=True)], "a number from 0 and below 1"),
        (Annotated[str, Holds(bool, "a name")], "a name"),
        (Annotated[int, OneOf(1, -1)], "one of 1, -1"),
    ],
)
def test_ranges_in_words(kind: Any, words: str) -> None:
    assert accepted_by(kind) == words


def test_an_open_end_is_refused_itself() -> None:
    kind = Annotated[float, Range(0.0, 1.0, above=True, below=True)]
    assert fitted("x", 0.5, kind) == 0.5
    for value in (0.0, 1.0):
        with pytest.raises(ConfigurationError, match="above 0 and below 1"):
            fitted("x", value, kind)
