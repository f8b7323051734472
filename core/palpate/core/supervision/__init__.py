"""The contact supervisor: watches every tick, clamps or trips, and lets nobody go on before a person says so."""

from palpate.core.supervision.fit import SensorFacts, require_fitting
from palpate.core.supervision.states import Guard
from palpate.core.supervision.supervisor import Supervisor
from palpate.core.supervision.values import Expectation, Intervention, Supervised, Trip, TripReason
from palpate.core.supervision_config import SupervisionConfig, weakened_lines

__all__ = [
    "Expectation",
    "Guard",
    "Intervention",
    "SensorFacts",
    "Supervised",
    "SupervisionConfig",
    "Supervisor",
    "Trip",
    "TripReason",
    "require_fitting",
    "weakened_lines",
]
