"""Six motors that are where their servos want them."""

from typing_extensions import override

from palpate.simulation.emulators.motors.plant import AXES, HOME_RAD, ArmGears, Backlash, Plant


class IdealPlant(Plant):
    """Six motors that are where their servos want them, but for the wrist's backlash."""

    def __init__(self, wrist_backlash_rad=0.0):
        self._gears, self._backlash = ArmGears(), Backlash(wrist_backlash_rad, HOME_RAD)
        self._motors = list(self._gears.counts(HOME_RAD))
        self._jammed = [False] * AXES

    @override
    def motor_counts(self, axis):
        return round(self._motors[axis])

    @override
    def set_motor_counts(self, axis, counts):
        if not self._jammed[axis]:
            self._motors[axis] = counts

    @override
    def release(self, axis):
        """It stays where it is until it is pushed."""

    def jam(self, axis):
        """Block a motor where it is."""
        self._jammed[axis] = True

    def push(self, axis, counts):
        """Displace a motor from outside; a held motor goes back at its next set-point."""
        self._motors[axis] += counts

    def joints_rad(self):
        """True joint angles, (6,) rad: behind the backlash, which encoders on the motors do not measure."""
        return self._backlash.follow(self._gears.joints_rad(tuple(self._motors)))
