"""Declared settings and JSON texts: what they accept, keep and refuse."""

import json
from dataclasses import dataclass, replace
from math import inf, nan
from typing import Annotated, Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.ports import parse_json
from palpate.core.ports.rig import SensorFacts
from palpate.core.ports.settings import Holds, OneOf, Range, Settings, accepted_by


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
    labels: dict[str, str] = None
    limit_N: Annotated[float, Range(0.0, above=True)] | None = None

    def __post_init__(self):
        if self.labels is None:
            object.__setattr__(self, "labels", {})
        super().__post_init__()

    def check(self):
        if self.turns > self.depth_mm:
            raise ConfigurationError(self.dotted("turns"), self.turns, "at most depth_mm")


class TestSettings:
    @pytest.mark.parametrize(
        ("field", "value", "accepted"),
        [
            ("depth_mm", 0.4999, "a number from 0.5 to 20"),
            ("depth_mm", 20.001, "a number from 0.5 to 20"),
            ("depth_mm", nan, "a number from 0.5 to 20"),
            ("depth_mm", "wide", "a number from 0.5 to 20"),
            ("turns", 0, "a whole number from 1 to 9"),
            ("turns", 2.0, "a whole number from 1 to 9"),
            ("shape", "Round", "one of round, square; did you mean round?"),
            ("shape", 3, "one of round, square"),
            ("cooled", 1, "true or false"),
            ("name", 1, "a text"),
            ("lamps", "ab", "a list, each one of a, b"),
            ("offsets", [1.0], "a list of 2 numbers"),
            ("labels", [1], "a table"),
            ("limit_N", 0.0, "a number above 0"),
        ],
    )
    def test_refusal_names_setting_value_and_what_would_be_right(self, field, value, accepted):
        with pytest.raises(ConfigurationError) as caught:
            Drill(**{field: value})
        error = caught.value
        assert (error.field, error.accepted) == (f"cell.drill.{field}", accepted)
        assert error.value is value
        with pytest.raises(ConfigurationError, match="must be"):
            replace(Drill(), **{field: value})

    def test_values_are_kept_in_one_form(self):
        drill = Drill(depth_mm=np.float64(7), offsets=[1, 2], lamps=["a"], limit_N=3)
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
    def test_ranges_in_words(self, kind, words):
        assert accepted_by(kind) == words


def parsed(text):
    return parse_json(f'{{"schema": "s", "x": {text}}}', "sample", "s")["x"]


@dataclass(frozen=True)
class Inner(Settings):
    """A part."""

    TABLE: ClassVar[str] = "inner"

    low: Annotated[int, Range(0)]
    high: int = 9

    def check(self):
        if self.low > self.high:
            raise ConfigurationError("inner.low", self.low, "at most high")


@dataclass(frozen=True)
class Sample(Settings):
    """A file."""

    TABLE: ClassVar[str] = "sample file"

    parts: tuple[Inner, ...]
    names: dict[str, str]
    anything: Annotated[Any, Holds(lambda value: value != 7, "not 7")] = 0
    extra: Inner | None = None


RAW = {"parts": [{"low": 1, "high": 2}], "names": {"a": "b"}, "anything": [1]}


class TestJson:
    def test_table_is_read_with_the_tables_in_it(self):
        assert Sample.read(RAW) == Sample((Inner(1, 2),), {"a": "b"}, [1])
        assert Sample.read(RAW | {"extra": {"low": 0, "high": 0}}).extra == Inner(0, 0)

    @pytest.mark.parametrize(
        ("change", "field", "accepted"),
        [
            ({"parts": {}}, "parts", "a list, each a table"),
            ({"parts": [3]}, "parts[0]", "an object"),
            ({"parts": [{"low": 1}]}, "parts[0]", "a table with the keys low, high; high is missing"),
            ({"parts": [{"low": -1, "high": 2}]}, "parts[0].low", "a whole number from 0 up"),
            ({"names": {"a": 1}}, "names.a", "a text"),
            ({"names": {"a\nb": 1}}, r"names.'a\nb'", "a text"),
            ({"anything": 7}, "anything", "not 7"),
            ({"y": 7}, "sample file", "a table with the keys parts, names, anything, extra; y is not one of them"),
        ],
    )
    def test_what_is_wrong_is_named_by_its_place(self, change, field, accepted):
        with pytest.raises(ConfigurationError) as refused:
            Sample.read(RAW | change)
        assert (refused.value.field, refused.value.accepted) == (field, accepted)

    @pytest.mark.parametrize(
        "text", ["", "{", "nonsense", "[NaN]", "[-Infinity]", '{"a": 1, "a": 2}', "[" * 100_000, "9" * 5000, "\ufeff{}"]
    )
    def test_what_is_not_strict_json_is_one_clear_line(self, text):
        with pytest.raises(ConfigurationError) as refused:
            parsed(text)
        assert "\n" not in str(refused.value)

    @given(st.text(max_size=40) | st.text('{}[]",:0e-NaInfity', max_size=12))
    def test_any_text_is_read_or_refused_in_one_line(self, text):
        refusal = None
        try:
            read = parsed(text)
        except ConfigurationError as error:
            refusal = str(error)
        if refusal is None:
            assert read == json.loads(f'{{"x": {text}}}')["x"]
        else:
            assert len(refusal.splitlines()) == 1

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            *((text, "an object") for text in ("[]", "null", '"s"')),
            *((text, "'s/1': this is no sample") for text in ("{}", '{"schema": 1}', '{"schema": "t/1", "x": 1}')),
            ('{"schema": "s/2", "x": 1}', "schema must be 's/1'"),
        ],
    )
    def test_another_schema_is_refused(self, text, said):
        with pytest.raises(ConfigurationError, match=said):
            parse_json(text, "sample", "s/1")


class TestSensorFacts:
    @pytest.mark.parametrize(
        ("name", "value"), [("noise_N", -0.1), ("range_N", (1.0, 0.0, 1.0)), ("rate_Hz", inf), ("frame", "")]
    )
    def test_what_no_sensor_has_is_refused(self, name, value):
        facts = {"noise_N": 0.1, "noise_Nm": 0.004, name: value}
        with pytest.raises(ConfigurationError) as error:
            SensorFacts(**facts)
        assert error.value.field == f"force_sensor.facts.{name}"
