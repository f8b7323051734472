"""Contact states, states with a memory, and the whole of perception, in files too."""

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import (
    FACTS,
    IdentityState,
    LastAction,
    LastSymbols,
    Perception,
    Situations,
    StateIdentifier,
    TaskFacts,
)
from palpate.core.perception import pipeline as stages
from palpate.core.perception.features import PrincipalComponents, SelectedChannels, SelfOrganisingMap
from palpate.core.perception.symbols import Clusters, GatedThresholds, RandomPartition, Thresholds
from palpate.core.ports import STAGES, Settings, register_stage

NINE = (0.0,) * 9
CORNERS = Perception(TaskFacts(FACTS), Situations(), IdentityState(Situations.symbols))


class TestSituations:
    @pytest.mark.parametrize(
        ("facts", "situation"),
        [
            ((0.0, -1.0, -1.0, 0.0, 0.0), "upright in the air"),
            ((0.1, 0.0, 0.0, 0.0, 0.0), "upright on the plate"),
            ((0.0, 1.2, 1.2, 0.0, 0.0), "upright in the hole"),
            ((1.0, -1.0, -3.0, 0.0, 0.0), "tilted in the air"),
            ((1.0, 0.8, -1.8, 0.0, 0.0), "tilted on the plate"),
            ((1.0, 2.0, 1.2, 0.9, 0.0), "corner turning"),
            ((1.0, 2.0, 1.2, 2.0, -1.2), "corner turning"),
            ((1.0, 2.0, 0.9, 2.0, 0.0), "corner wedged"),
            ((1.0, 2.0, 1.2, 2.0, 0.0), "corner seated"),
        ],
    )
    def test_situations_are_told_apart_by_lean_depth_walls_and_torque(self, facts, situation):
        assert CORNERS.symbols[CORNERS.observe(NINE + facts)[0]] == situation


AB = ("a", "b")


class TestStates:
    def test_without_a_memory_the_state_is_the_last_symbol_whatever_came_before(self):
        identifier = IdentityState(("a", "b", "c"))
        assert identifier.states == ("a", "b", "c")
        assert [identifier.update(symbol) for symbol in (2, 0, 0, 1, 2)] == [2, 0, 0, 1, 2]
        identifier.reset()
        assert identifier.update(1) == 1
        assert isinstance(identifier, StateIdentifier)

    @given(st.integers(1, 4), st.integers(1, 3), st.lists(st.integers(0, 3), max_size=12))
    def test_name_of_the_state_tells_the_symbols(self, count, length, word):
        names = "abcd"[:count]
        identifier = LastSymbols(tuple(names), length)
        assert len(identifier.states) == sum(count**size for size in range(1, length + 1))
        past = []
        for symbol in word:
            past.append(names[symbol % count])
            state = identifier.update(symbol % count)
            assert identifier.states[state] == " > ".join(past[-length:])

    @given(st.lists(st.integers(0, 1), max_size=6), st.integers(0, 1))
    def test_it_goes_on_where_its_memory_was_kept(self, word, after):
        first, second = LastSymbols(AB, 3), LastSymbols(AB, 3)
        for symbol in word:
            first.update(symbol)
        second.set_state(json.loads(json.dumps(first.get_state())))
        assert first.update(after) == second.update(after)

    @pytest.mark.parametrize("memory", [[0.0, 1.0, 1.0], [2.0], [0.5]])
    def test_another_memory_is_refused(self, memory):
        identifier = LastSymbols(AB, 2)
        identifier.update(1)
        with pytest.raises(ConfigurationError, match=r"identifier\.state .* at most 2 whole numbers from 0 to 1"):
            identifier.set_state(memory)
        assert identifier.get_state() == [1.0]

    @pytest.mark.parametrize("symbol", [-1, 2])
    def test_unknown_symbol_is_refused(self, symbol):
        with pytest.raises(CommandError, match=f"from 0 to 1: {symbol}"):
            LastSymbols(AB, 2).update(symbol)

    def test_state_can_be_the_last_symbol_and_the_kind_of_action_before_it(self):
        last = LastAction(("A", "B"), ("push", "tilt"))
        assert last.states == (
            "A at first",
            "B at first",
            "A after push",
            "B after push",
            "A after tilt",
            "B after tilt",
        )
        led = [(0, None), (1, "push 1"), (0, "tilt 1"), (1, "another")]
        assert [last.states[last.update(symbol, action)] for symbol, action in led] == [
            "A at first", "B after push", "A after tilt", "B at first",
        ]  # fmt: skip
        last.set_state(last.get_state())
        with pytest.raises(CommandError):
            last.update(2)
        with pytest.raises(ConfigurationError):
            last.set_state([1.0])


TABLE = np.random.default_rng(2).normal(size=(60, 9)) * np.geomspace(1e-3, 10.0, 9)
GATED = GatedThresholds.of({"x": (-1e-3, 1e-3), "y": (-1e-3, 1e-3)}, {"tx": (-0.1, 0.1), "ty": (-0.1, 0.1)})
EXTRACTORS = [
    SelectedChannels(("x", "y", "tx", "ty")),
    PrincipalComponents.fit(TABLE, 3),
    PrincipalComponents.fit(TABLE, 2, ("fx", "fy", "fz")),
    SelfOrganisingMap.fit(TABLE, 2, 3, 0, iterations=200),
]
SYMBOLISERS = [
    GATED,
    Thresholds.of({"a": (0.1,), "b": (-1 / 3, 1 / 3), "c": (0.0,), "d": (0.0,)}),
    RandomPartition.draw(dict.fromkeys("abcd", (-1.0, 2.0)), 5, 0),
    Clusters.fit(TABLE[:, :4], 4, 0, ("x", "y", "z", "fx")),
]


def through_json(stage):
    # Sorted keys, because a file that embeds a stage may sort them: no meaning may hang on the order.
    return stages.stage_from_dict(json.loads(json.dumps(stages.stage_to_dict(stage), sort_keys=True)))


def paper():
    return Perception(EXTRACTORS[0], GATED, IdentityState(GATED.symbols))


@dataclasses.dataclass(frozen=True)
class Doubled(Settings):
    """A third-party stage."""

    by: float


BANDS = Thresholds.of({"x": (-1e-3, 1e-3), "tx": (-0.01, 0.01)})


def signal(x, tx):
    return (x, 9.0, 9.0, 9.0, 9.0, 9.0, tx, 9.0, 9.0)


class TestPipeline:
    @pytest.mark.parametrize("stage", EXTRACTORS + SYMBOLISERS, ids=lambda s: type(s).__name__)
    def test_stages_come_back_with_identical_output(self, stage):
        back = through_json(stage)
        assert back == stage
        assert type(back) is type(stage)
        for names in ("names", "features", "symbols"):
            assert getattr(back, names, None) == getattr(stage, names, None)
        use, width = ("extract", 9) if hasattr(stage, "extract") else ("symbol", 4)
        for row in TABLE[:, :width].tolist():
            assert getattr(back, use)(tuple(row)) == getattr(stage, use)(tuple(row))

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"schema": "palpate.perception/2"}, r"perception\.schema must be .*perception/3"),
            ({"extractor": stages.stage_to_dict(GATED)}, r"perception\.extractor\.kind must be a kind of extractor"),
            ({"identifier": {"kind": "identity", "symbols": ["a"]}}, r"perception\.identifier\.symbols must be "),
        ],
    )
    def test_stages_that_do_not_fit_together_are_named(self, change, message):
        with pytest.raises(ConfigurationError, match="^" + message):
            stages.perception_from_dict(stages.perception_to_dict(paper()) | change)

    def test_strangers_stage_can_be_written_once_it_is_registered(self, monkeypatch):
        # What is added during the test goes with it.
        monkeypatch.setitem(STAGES, "doubled", Doubled)
        del STAGES["doubled"]
        with pytest.raises(ConfigurationError, match=r"perception\.stage must be .*Doubled"):
            stages.stage_to_dict(Doubled(2.0))
        register_stage("doubled", Doubled)
        register_stage("doubled", Doubled)
        assert through_json(Doubled(0.1)) == Doubled(0.1)
        with pytest.raises(ConfigurationError, match="not taken"):
            register_stage("clusters", Doubled)
        with pytest.raises(ConfigurationError, match="derives from Settings"):
            register_stage("number", int)

    def test_measurement_becomes_a_symbol_and_a_state(self):
        perception = Perception(SelectedChannels(("x", "tx")), BANDS, IdentityState(BANDS.symbols))
        symbol, state = perception.observe(signal(2e-3, -0.02))
        assert perception.symbols[symbol] == perception.states[state] == "x+ tx-"

    def test_identifier_with_a_memory_fits_in(self):
        perception = Perception(SelectedChannels(("x", "tx")), BANDS, LastSymbols(BANDS.symbols, 2))

        def seen(x_m):
            return perception.states[perception.observe(signal(x_m, 0.0))[1]]

        assert [seen(x_m) for x_m in (0.0, 0.0, 1.0)] == ["x0 tx0", "x0 tx0 > x0 tx0", "x0 tx0 > x+ tx0"]
        memory = perception.get_state()
        perception.reset()
        assert seen(0.0) == "x0 tx0"
        perception.identifier.set_state(memory)
        assert seen(0.0) == "x+ tx0 > x0 tx0"

    def test_features_in_another_order_than_the_thresholds_are_refused(self):
        with pytest.raises(ConfigurationError, match=r"symboliser\.features must be .* tx, x \(got \['x', 'tx'\]\)"):
            Perception(SelectedChannels(("tx", "x")), BANDS, IdentityState(BANDS.symbols))

    def test_measurement_that_cannot_be_one_is_refused(self):
        perception = Perception(SelectedChannels(("x", "tx")), BANDS, IdentityState(BANDS.symbols))
        with pytest.raises(CommandError, match="9 channels"):
            perception.observe((0.0,) * 6)
        with pytest.raises(CommandError, match="finite"):
            perception.observe(signal(0.0, math.nan))
