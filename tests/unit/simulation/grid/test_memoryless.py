"""The best policy with one action a symbol."""

from __future__ import annotations

from math import inf

import pytest

from palpate.core.errors import ConfigurationError
from palpate.simulation.grid.maps import SCENARIO_2, TWIN, GridMap
from palpate.simulation.grid.memoryless import best_fixed_actions


@pytest.mark.parametrize(("notation", "steps", "reaches"), [(SCENARIO_2, 34.9583, 0.6875), (TWIN, 47.7708, 0.5417)])
def test_it_is_that_of_another_program(notation: str, steps: float, reaches: float) -> None:
    best = best_fixed_actions(GridMap.from_regions(notation))
    assert (best.limited_steps, best.reaches) == (pytest.approx(steps, abs=5e-5), pytest.approx(reaches, abs=5e-5))
    assert best.steps == inf


def test_by_hand() -> None:
    # Right is best where A is: the two on the left arrive, the one on the right does not.
    best = best_fixed_actions(GridMap.from_text("AA·A"), step_limit=10)
    assert (best.limited_steps, best.reaches) == (pytest.approx((2 + 1 + 10) / 3), pytest.approx(2 / 3))
    # With fewer steps than there are cells, a way that is too long counts as none.
    assert best_fixed_actions(GridMap.from_text("AAA·"), step_limit=2).limited_steps == pytest.approx((2 + 2 + 1) / 3)


def test_where_every_region_has_its_own_symbol_it_is_the_optimum() -> None:
    assert best_fixed_actions(GridMap.from_text("ABC\nD·E\n")).steps == pytest.approx(1.0)


def test_too_many_symbols_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="at most 6"):
        best_fixed_actions(GridMap.from_regions("ABC/D·E/FGH", 3))
