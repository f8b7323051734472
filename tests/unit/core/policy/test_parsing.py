import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import PolicyFileError
from palpate.core.policy.parsing import (
    parse_json,
    plain_json,
    read_count,
    read_list,
    read_number,
    read_object,
    read_text,
)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_keep_every_bit(number):
    read = read_number("x", parse_json(json.dumps(number)))
    assert read.hex() == number.hex()


@pytest.mark.parametrize(
    "text",
    ["", "{", "nonsense", "[NaN]", "[-Infinity]", '{"a": 1, "a": 2}', "[" * 100_000, "9" * 5000, "\ufeff{}"],
)
def test_what_is_not_strict_json_is_one_clear_line(text):
    with pytest.raises(PolicyFileError) as refused:
        parse_json(text)
    assert "\n" not in str(refused.value)


@given(st.text(max_size=40) | st.text('{}[]",:0e-NaInfity', max_size=12))
def test_any_text_is_read_or_refused_in_one_line(text):
    refusal = None
    try:
        read = parse_json(text)
    except PolicyFileError as error:
        refusal = str(error)
    if refusal is None:
        assert read == json.loads(text)
    else:
        assert len(refusal.splitlines()) == 1


@pytest.mark.parametrize(
    ("read", "bad"),
    [
        (read_object, []),
        (read_object, None),
        (read_list, {}),
        (read_list, "ab"),
        (read_text, 1),
        (read_text, None),
        (read_number, True),
        (read_number, "1"),
        (read_number, math.inf),
        (read_number, 10**400),
        (read_number, None),
        (read_count, 1.0),
        (read_count, -1),
        (read_count, True),
    ],
)
def test_values_of_another_kind_are_refused_with_their_place(read, bad):
    with pytest.raises(PolicyFileError) as refused:
        read("here[3]", bad)
    assert refused.value.field == "here[3]"
    assert refused.value.value == bad


def test_a_list_has_its_length():
    assert read_list("x", [1, 2], 2) == [1, 2]
    with pytest.raises(PolicyFileError, match="a list of 2"):
        read_list("x", [1, 2, 3], 2)


def test_an_object_has_its_keys_and_no_others():
    assert read_object("x", {"b": 1, "a": 2}, ("a", "b")) == {"a": 2, "b": 1}
    with pytest.raises(PolicyFileError, match="missing b, c"):
        read_object("x", {"a": 1}, ("a", "b", "c"))
    with pytest.raises(PolicyFileError, match="unknown key 'd'"):
        read_object("x", {"a": 1, "d": 1}, ("a",))


def test_plain_values_are_copied_as_json_gives_them_back():
    inner = [1, (2.5, None)]
    copied = plain_json("x", {"a": inner})
    inner.append(3)
    assert copied == {"a": [1, [2.5, None]]}


@pytest.mark.parametrize("value", [{"a": math.nan}, {"a": object()}, {"a": {1, 2}}])
def test_what_json_cannot_express_is_refused(value):
    with pytest.raises(PolicyFileError) as refused:
        plain_json("perception", value)
    assert refused.value.field == "perception"
