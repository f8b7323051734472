"""Settings of the work cell: what cannot be is refused by name."""

from __future__ import annotations

from dataclasses import fields
from math import inf, nan
from typing import Any

import pytest

from palpate.core.errors import ConfigurationError
from palpate.simulation.work_cell.config import CellConfig, ComplianceConfig, PegConfig, SensorConfig

PREFIXES = {
    PegConfig: "cell.peg.",
    ComplianceConfig: "cell.compliance.",
    SensorConfig: "cell.sensor.",
    CellConfig: "cell.",
}
NUMBERS = [(kind, field.name) for kind in PREFIXES for field in fields(kind) if isinstance(field.default, (int, float))]


def refused(kind: Any, name: str, value: Any) -> str:
    with pytest.raises(ConfigurationError) as error:
        kind(**{name: value})
    assert error.value.value is value
    return error.value.field


@pytest.mark.parametrize(("kind", "name"), NUMBERS)
@pytest.mark.parametrize("value", [nan, inf, -inf, -1e9, 1e9, "3", None])
def test_a_number_out_of_range_is_refused_by_name(kind: type, name: str, value: Any) -> None:
    assert refused(kind, name, value) == PREFIXES[kind] + name


@pytest.mark.parametrize(
    ("kind", "name"), [(PegConfig, "wall_boxes"), (PegConfig, "rim_spheres"), (CellConfig, "substeps")]
)
def test_counts_are_whole(kind: type, name: str) -> None:
    assert refused(kind, name, 20.5) == PREFIXES[kind] + name


@pytest.mark.parametrize("value", ["", "oval", "Round"])
def test_an_unknown_cross_section_is_refused(value: str) -> None:
    assert refused(PegConfig, "cross_section", value) == "cell.peg.cross_section"


def test_the_defaults_are_the_paper_s_peg_and_hole() -> None:
    peg = CellConfig().peg
    assert (peg.cross_section, peg.diameter_mm, peg.diameter_mm + 2 * peg.clearance_mm) == ("round", 29.0, 29.15)


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        (PegConfig, "friction", 0.0),
        (ComplianceConfig, "centre_above_tip_mm", 140.0),
        (SensorConfig, "encoder_counts_share", 0),
        (CellConfig, "substeps", 3),
    ],
)
def test_the_ends_of_a_range_are_accepted(kind: Any, name: str, value: float) -> None:
    assert getattr(kind(**{name: value}), name) == value
