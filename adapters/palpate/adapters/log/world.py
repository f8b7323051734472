"""Rig properties in a log that are not part of the rig's own world record."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from math import inf
from typing import Any, Final

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Rig, SensorFacts, Vector3, WorldRecord

_SENSOR: Final = "force_sensor_facts"
_ACKNOWLEDGED: Final = "acknowledged"


def world_of(rig: Rig) -> WorldRecord:
    """Return the rig's world record, extended with the force sensor's properties and the acknowledgements of trips."""
    world = rig.world()
    facts = sensor_facts(rig.sensor_facts)
    acknowledged = [asdict(each) for each in rig.latch.acknowledgements]
    return replace(world, facts=world.facts | facts | ({_ACKNOWLEDGED: acknowledged} if acknowledged else {}))


def sensor_facts(facts: SensorFacts) -> dict[str, Any]:
    """Return a force sensor's properties as stored in a log, with null for an unlimited range."""
    plain = asdict(facts)
    return {_SENSOR: plain | {name: [None if each == inf else each for each in plain[name]] for name in _RANGES}}


def recorded_sensor(world_json: str) -> SensorFacts:
    """Return the force sensor's properties from a log.

    Raises:
        ConfigurationError: The recorded values are not properties of a sensor.
    """
    facts: Any = _world(world_json).get(_SENSOR)
    try:
        ranges = {name: tuple(inf if each is None else each for each in facts[name]) for name in _RANGES}
        return SensorFacts(**(facts | ranges))
    except (KeyError, TypeError) as error:
        raise ConfigurationError(_SENSOR, facts, "the facts of a force sensor") from error


def recorded_turn(world_json: str) -> Vector3:
    """Return the logged rotation vector from the task's axes to the hole's, or zero if the hole was not rotated."""
    turn = _world(world_json).get("hole_turn_rad")
    if not isinstance(turn, list) or len(turn) != 3 or not all(isinstance(each, float) for each in turn):
        return 0.0, 0.0, 0.0
    return turn[0], turn[1], turn[2]


def recorded_drawn(world_json: str) -> dict[str, float]:
    """Return the other random quantities of the trial, as in ``GroundTruth.drawn``, or an empty mapping."""
    drawn = _world(world_json).get("drawn")
    given = drawn.items() if isinstance(drawn, Mapping) else ()
    return {name: float(value) for name, value in given if isinstance(value, (int, float))}


def _world(world_json: str) -> Mapping[str, Any]:
    world: Any = json.loads(world_json or "{}")
    return world if isinstance(world, Mapping) else {}


_RANGES: Final = ("range_N", "range_Nm")
