import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.symbols import GatedThresholds, Symboliser, Thresholds

MM = 1e-3
KGF_MM = 9.80665e-3
PAPER = GatedThresholds.of({"x": (-MM, MM), "y": (-MM, MM)}, {"tx": (-KGF_MM, KGF_MM), "ty": (-KGF_MM, KGF_MM)})


def above(value: float) -> float:
    return math.nextafter(value, math.inf)


@pytest.mark.parametrize(
    ("value", "name"),
    [
        (-math.nextafter(MM, 1), "x-"),
        (-MM, "x0"),
        (-0.0, "x0"),
        (MM, "x0"),
        (above(MM), "x+"),
        (1e9, "x+"),
        (-1e9, "x-"),
    ],
)
def test_a_value_on_a_threshold_belongs_to_the_middle(value: float, name: str) -> None:
    stage = Thresholds.of({"x": (-MM, MM)})
    assert stage.symbols[stage.symbol((value,))] == name


@settings(deadline=None)
@given(st.floats(-1e3, 1e3), st.lists(st.floats(0.1, 100.0), min_size=1, max_size=4, unique=True))
def test_mirrored_values_lie_in_mirrored_bands(value: float, sizes: list[float]) -> None:
    sizes.sort()
    stage = Thresholds.of({"x": [-t for t in reversed(sizes)] + sizes})
    last = len(stage.symbols) - 1
    assert stage.symbol((value,)) + stage.symbol((-value,)) == last
    assert stage.symbol((value,)) == len(sizes) + sum(value > t for t in sizes) - sum(value < -t for t in sizes)


def test_the_papers_seventeen_symbols_are_exactly_these_and_all_reachable() -> None:
    outside = [f"x{a} y{b}" for a, b in itertools.product("-0+", repeat=2) if a + b != "00"]
    inside = [f"tx{a} ty{b}" for a, b in itertools.product("-0+", repeat=2)]
    assert PAPER.symbols == (*outside, *inside)
    assert len(PAPER.symbols) == 17
    size = {"-": -2.0, "0": 0.0, "+": 2.0}
    seen = set()
    for a, b, c, d in itertools.product("-0+", repeat=4):
        number = PAPER.symbol((size[a] * MM, size[b] * MM, size[c] * KGF_MM, size[d] * KGF_MM))
        assert PAPER.symbols[number] == (f"tx{c} ty{d}" if a + b == "00" else f"x{a} y{b}")
        seen.add(number)
    assert seen == set(range(17))


@pytest.mark.parametrize("stage", [Thresholds.of(dict.fromkeys("abcd", (-1, 1))), PAPER])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(4))
def test_what_is_not_finite_never_gets_a_symbol(stage: Symboliser, bad: float, place: int) -> None:
    features = [5.0] * 4  # outside the gate: even a feature that is not looked at must be sound
    features[place] = bad
    with pytest.raises(CommandError, match="features must be finite"):
        stage.symbol(tuple(features))


@pytest.mark.parametrize(
    ("thresholds", "message"),
    [
        ({}, r"symboliser\.features"),
        ({"x": ()}, r"symboliser\.thresholds"),
        ({"x": (1.0, 1.0)}, r"symboliser\.thresholds = .* rising numbers"),
        ({"x": (1.0, -1.0)}, r"symboliser\.thresholds = .* rising numbers"),
        ({"x": (math.nan,)}, r"symboliser\.thresholds"),
        ({"x": ("1",)}, r"symboliser\.thresholds"),
        ({name: range(9) for name in "abcdef"}, r"symboliser\.thresholds = .* at most 100000 symbols"),
    ],
)
def test_unusable_thresholds_are_named(thresholds: dict[str, tuple[float, ...]], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Thresholds.of(thresholds)


def test_thresholds_belong_to_features_and_a_gate_needs_a_middle_and_separate_ones() -> None:
    with pytest.raises(ConfigurationError, match="each of the 2 features"):
        Thresholds(("x", "y"), ((-1.0, 1.0),))
    with pytest.raises(ConfigurationError, match=r"symboliser\.outer = .* an even number of thresholds"):
        GatedThresholds.of({"x": (0.0,)}, {"tx": (-1, 1)})
    with pytest.raises(ConfigurationError, match="each only once"):
        GatedThresholds.of({"x": (-1, 1)}, {"x": (-1, 1)})
    with pytest.raises(ConfigurationError, match=r"symboliser\.inner = .* 'thresholds'"):
        GatedThresholds(Thresholds.of({"x": (-1, 1)}), None)  # type: ignore[arg-type]
