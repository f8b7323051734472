"""The contact supervisor: watches every tick, clamps or trips, and lets nobody go on before a person says so."""

from palpate.core.supervision.config import SupervisionConfig, weakened_lines
from palpate.core.supervision.fit import SensorFacts, require_fitting
from palpate.core.supervision.supervisor import Guard, Supervisor

__all__ = [
    "Guard",
    "SensorFacts",
    "SupervisionConfig",
    "Supervisor",
    "require_fitting",
    "weakened_lines",
]
