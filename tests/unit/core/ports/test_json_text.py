import json
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Holds, Range, Settings, parse_json


def parsed(text: str) -> Any:
    return parse_json(f'{{"schema": "s", "x": {text}}}', "sample", "s")["x"]


@dataclass(frozen=True)
class Inner(Settings):
    """A part."""

    TABLE: ClassVar[str] = "inner"

    low: Annotated[int, Range(0)]
    high: int = 9

    def check(self) -> None:
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


RAW: dict[str, Any] = {"parts": [{"low": 1, "high": 2}], "names": {"a": "b"}, "anything": [1]}


def test_a_table_is_read_with_the_tables_in_it() -> None:
    assert Sample.read(RAW) == Sample((Inner(1, 2),), {"a": "b"}, [1])
    assert Sample.read(RAW | {"extra": {"low": 0, "high": 0}}).extra == Inner(0, 0)


@pytest.mark.parametrize(
    ("change", "field", "accepted"),
    [
        ({"parts": {}}, "parts", "a list, each a table"),
        ({"parts": [3]}, "parts[0]", "an object"),
        ({"parts": [{"low": 1}]}, "parts[0]", "the keys low, high (missing high)"),
        ({"parts": [{"low": 1, "high": 2, "x": 0}]}, "parts[0]", "the keys low, high (unknown key 'x')"),
        ({"parts": [{"low": -1, "high": 2}]}, "parts[0].low", "a whole number from 0 up"),
        ({"parts": [{"low": 3, "high": 2}]}, "parts[0].low", "at most high"),
        ({"names": {"a": 1}}, "names.a", "a text"),
        ({"names": {"a\nb": 1}}, r"names.'a\nb'", "a text"),
        ({"anything": 7}, "anything", "not 7"),
        ({"y": 7}, "sample file", "the keys parts, names, anything, extra (unknown key 'y')"),
    ],
)
def test_what_is_wrong_is_named_by_its_place(change: dict[str, Any], field: str, accepted: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        Sample.read(RAW | change)
    assert (refused.value.field, refused.value.accepted) == (field, accepted)


@pytest.mark.parametrize(
    "text", ["", "{", "nonsense", "[NaN]", "[-Infinity]", '{"a": 1, "a": 2}', "[" * 100_000, "9" * 5000, "\ufeff{}"]
)
def test_what_is_not_strict_json_is_one_clear_line(text):
    with pytest.raises(ConfigurationError) as refused:
        parsed(text)
    assert "\n" not in str(refused.value)


@given(st.text(max_size=40) | st.text('{}[]",:0e-NaInfity', max_size=12))
def test_any_text_is_read_or_refused_in_one_line(text):
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
        ('{"schema": "s/2", "x": 1}', "schema = 's/2' is refused: 's/1'"),
    ],
)
def test_another_schema_is_refused(text, said):
    with pytest.raises(ConfigurationError, match=said):
        parse_json(text, "sample", "s/1")
