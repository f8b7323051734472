"""A PIC-SERVO module on an NMC bus: addresses, commands and replies."""

import struct
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from palpate.simulation.emulators.motors import JointPlant
from palpate.simulation.emulators.nmc import frames
from palpate.simulation.emulators.nmc.servo import GainParameters, PicServo

_SERVO_TYPE, _VERSION = 0, 10
_GROUP_BIT: Final = 0x80
_INT16: Final = (-(1 << 15), (1 << 15) - 1)
_TRAJECTORY_FIELDS: Final = (
    (frames.Load.POSITION, "i", "position_counts"),
    (frames.Load.VELOCITY, "I", "velocity"),
    (frames.Load.ACCELERATION, "I", "acceleration"),
)
_POSITION_FIELDS: Final = frames.Load.POSITION | frames.Load.VELOCITY | frames.Load.ACCELERATION


class NmcModule:
    """A servo module. The bus selects its frames, and `execute()` handles the host's commands.

    Attributes:
        rejected: Number of commands since construction with an unsuitable length or kind. They have no effect (assumed:
            the firmware would use the contents of its buffer). Only trapezoidal trajectories that start
            immediately are emulated; homing and outputs are not.
    """

    def __init__(self, axis: int, plant: JointPlant) -> None:
        self._axis, self._plant = axis, plant
        self.servo = PicServo(axis, plant)
        self.rejected = self.analog = 0
        self._ticks = 0
        self._power_up()

    def power_up(self) -> None:
        """Return to the state after power-up, as HARD_RESET does. The motor supply and the switches do not change."""
        previous = self.servo
        self.servo = PicServo(self._axis, self._plant, powered=previous.powered)
        self.set_limits(*previous.limits)
        self._power_up()

    def set_limits(self, limit1: bool, limit2: bool) -> None:
        """Set the states of the two limit switches."""
        self.servo.limits = (limit1, limit2)

    def tick(self) -> None:
        """Execute one tick of 0.512 ms. The servo loop runs every SR ticks."""
        self._ticks += 1
        if self._ticks >= self.servo.gains.rate_divisor:
            self._ticks = 0
            self.servo.tick()

    def execute(self, frame: frames.Frame) -> bytes:
        """Execute a command addressed to this module and return the reply."""
        once = self.mask
        if frame.intact:
            if frame.command == frames.CommandCode.HARD_RESET:
                self.power_up()
                return b""
            if frame.command == frames.CommandCode.READ_STAT and len(frame.data) == 1:
                once = frame.data[0]
            elif not self._carry_out(frame):
                self.rejected += 1
            else:
                once = self.mask
        return self._reply(once, intact=frame.intact)

    def _power_up(self) -> None:
        self.address, self.group, self.leader = 0, 0xFF, False
        self.baud = frames.POWER_UP_BAUD
        self.mask = 0

    def _carry_out(self, frame: frames.Frame) -> bool:
        data, servo = frame.data, self.servo
        match frame.command, len(data):
            case frames.CommandCode.NOP, 0:
                pass
            case frames.CommandCode.RESET_POS, 0:
                servo.set_position(0)
            case frames.CommandCode.SET_ADDR, 2:
                self.address, self.group = data[0], data[1] | _GROUP_BIT
                self.leader = not data[1] & _GROUP_BIT
            case frames.CommandCode.DEF_STAT, 1:
                self.mask = data[0]
            case frames.CommandCode.LOAD_TRAJ, n if n:
                return self._load(data)
            case frames.CommandCode.SET_GAIN, 14 | 15:
                servo.gains = GainParameters.decoded(data)
            case frames.CommandCode.STOP_MOTOR, 1 | 5:
                how = frames.StopMotorBits(data[0])
                if bool(how & frames.StopMotorBits.HERE) != (len(data) == 5):
                    return False
                servo.stop(how, struct.unpack("<i", data[1:])[0] if len(data) == 5 else 0)
            case frames.CommandCode.SET_BAUD, 1 if frame.address & _GROUP_BIT:
                self.baud = frames.baud_of_divisor(data[0])
            case frames.CommandCode.CLEAR_BITS, 0:
                servo.clear_bits()
            case _:
                return False
        return True

    def _load(self, data: bytes) -> bool:
        control = frames.Load(data[0])
        if control & ~_POSITION_FIELDS != frames.Load.SERVO | frames.Load.NOW:
            return False
        names = [name for field, _, name in _TRAJECTORY_FIELDS if control & field]
        layout = "<" + "".join(code for field, code, _ in _TRAJECTORY_FIELDS if control & field)
        if len(data) != 1 + struct.calcsize(layout):
            return False
        values = struct.unpack(layout, data[1:])
        self.servo.buffer = replace(self.servo.buffer, control=control, **dict(zip(names, values, strict=True)))
        self.servo.start()
        return True

    def _reply(self, mask: int, *, intact: bool) -> bytes:
        """Return the status byte, the items in mask-bit order, and the checksum (FACT, libnmc)."""
        servo = self.servo
        items: tuple[Callable[[], bytes], ...] = (
            lambda: struct.pack("<i", servo.measured_counts),
            lambda: bytes([self.analog]),
            lambda: _int16(servo.velocity_counts),
            lambda: bytes([self._auxiliary()]),
            lambda: struct.pack("<i", servo.home_counts),
            lambda: bytes([_SERVO_TYPE, _VERSION]),
            lambda: _int16(servo.error_counts),
            lambda: bytes(1),
        )
        reported = b"".join(data() for place, data in enumerate(items) if mask >> place & 1)
        return frames.sealed(bytes([self._status(intact=intact)]) + reported)

    def _status(self, *, intact: bool) -> int:
        servo = self.servo
        return (
            frames.StatusBits.MOVE_DONE * servo.profile.done
            | frames.StatusBits.CHECKSUM_ERROR * (not intact)
            | frames.StatusBits.OVERCURRENT * servo.overcurrent
            | frames.StatusBits.POWER_ON * servo.powered
            | frames.StatusBits.POSITION_ERROR * servo.position_error
            | frames.StatusBits.LIMIT1 * servo.limits[0]
            | frames.StatusBits.LIMIT2 * servo.limits[1]
        )

    def _auxiliary(self) -> int:
        servo = self.servo
        return (
            frames.Auxiliary.POSITION_WRAP * servo.wrapped
            | frames.Auxiliary.SERVO_ON * servo.on
            | frames.Auxiliary.ACCELERATED * servo.profile.accelerated
            | frames.Auxiliary.SLEWED * servo.profile.slewed
            | frames.Auxiliary.SERVO_OVERRUN * servo.overrun
        )


def _int16(value: int) -> bytes:
    low, high = _INT16
    return struct.pack("<h", max(low, min(high, value)))
