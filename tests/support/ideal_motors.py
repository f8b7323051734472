"""Six motors that are where their servos want them."""

from palpate.simulation.emulators.motors.plant import AXES, HOME_RAD, ArmGears


class IdealPlant:
    """Six motors that are where their servos want them."""

    def __init__(self):
        self._gears = ArmGears()
        self._motors = list(self._gears.counts(HOME_RAD))
        self._jammed = [False] * AXES

    def motor_counts(self, axis):
        return round(self._motors[axis])

    def set_motor_counts(self, axis, counts):
        if not self._jammed[axis]:
            self._motors[axis] = counts

    def release(self, axis):
        """It stays where it is until it is pushed."""

    def jam(self, axis):
        """Block a motor where it is."""
        self._jammed[axis] = True

    def push(self, axis, counts):
        """Displace a motor from outside; a held motor goes back at its next set-point."""
        self._motors[axis] += counts

    def joints_rad(self):
        """Joint angles, (6,) rad."""
        return self._gears.joints_rad(tuple(self._motors))
