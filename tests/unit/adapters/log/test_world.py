"""The facts of the force sensor in a log: as the rig said them, and none in a log from before."""

from math import inf

import pytest

from palpate.adapters.log import dump_json, recorded_sensor, world_of
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import ConfigurationError
from palpate.core.ports import SensorFacts
from tests.unit.adapters.samples import QUICK, ready_pose


class OtherSensor(SimulatedRig):
    """A cell whose sensor is said to be another."""

    facts = SensorFacts(0.05, 0.002, (100.0, 100.0, inf), (5.5, 5.5, 6.0), 200.0)

    @property
    def sensor_facts(self) -> SensorFacts:
        return self.facts


def test_they_come_back_as_they_were() -> None:
    with OtherSensor(QUICK, ready_pose()) as rig:
        rig.prepare(0)
        world = world_of(rig)
    assert recorded_sensor(dump_json(world.facts)) == OtherSensor.facts
    assert world.facts["ticks"] == 0
    assert "acknowledged" not in world.facts


@pytest.mark.parametrize(
    "facts", ["null", "3", "{}", '{"noise_N": -1, "noise_Nm": 0, "range_N": [1], "range_Nm": [1]}']
)
def test_what_is_altered_is_refused(facts: str) -> None:
    with pytest.raises(ConfigurationError):
        recorded_sensor(f'{{"force_sensor_facts": {facts}}}')
