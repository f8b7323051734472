"""Emulated controller with modes, registers, control program and joint motion, but without sockets or a clock."""

import enum
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Final

from palpate.simulation.emulators.ur.kinematics import tool_pose

JOINTS: Final = 6
CYCLE_NS: Final = 2_000_000
_CYCLE_S: Final = 2e-3
_REGISTERS: Final = 48
_SERVO_J, _SERVO_STOP, _PROTECTIVE, _WATCHDOG, _TCP_OFFSET, _END = 11, 16, 31, 35, 40, 255
_READY, _DONE = 1, 2
_FASTEST_RAD_S: Final = 3.14
_SERVO_RAD_S2: Final = 40.0
_STOP_RAD_S2: Final = 15.0
_UNLOCK_NS: Final = 5_000_000_000
_MOST_SCRIPT: Final = 1 << 20

Value = float | int | tuple[float, ...] | tuple[int, ...]


class RobotMode(enum.IntEnum):
    """Values of RTDE's robot_mode field."""

    POWER_OFF = 3
    IDLE = 5
    RUNNING = 7


class SafetyMode(enum.IntEnum):
    """Values of RTDE's safety_mode field."""

    NORMAL = 1
    PROTECTIVE_STOP = 3
    SAFEGUARD_STOP = 5
    ROBOT_EMERGENCY_STOP = 7
    FAULT = 9


class RuntimeState(enum.IntEnum):
    """Values of RTDE's runtime_state field."""

    STOPPED = 1
    PLAYING = 2
    PAUSED = 4


_STATUS_BITS: Final = {
    SafetyMode.NORMAL: 0x001, SafetyMode.PROTECTIVE_STOP: 0x404, SafetyMode.SAFEGUARD_STOP: 0x410,
    SafetyMode.ROBOT_EMERGENCY_STOP: 0x4C0, SafetyMode.FAULT: 0x600,
}  # fmt: skip


@dataclass(frozen=True)
class ControllerConfig:
    """Controller configuration.

    Attributes:
        arm: Arm name.
        payload_cog_m: The payload's centre of gravity relative to the flange, (3,).
        tcp_offset: Tool centre point relative to the flange: position in metres and rotation vector, (6,).
    """

    version: tuple[int, int, int, int] = (5, 11, 1, 108318)
    serial: str = "20205500001"
    arm: str = "ur5"
    payload_kg: float = 0.0
    payload_cog_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    tcp_offset: tuple[float, ...] = (0.0,) * 6


class UrController:
    """A controller and its arm.

    Joints approach their servo target with the time constant of servoj's look-ahead (INFERENCE), within the speed and
    acceleration limits. They brake when the program ends for any reason.

    Attributes:
        owner: For each input register, the session that may write it.
    """

    def __init__(
        self,
        joints_rad: tuple[float, ...],
        wrench: Callable[[int], tuple[float, ...]],
        config: ControllerConfig | None = None,
    ) -> None:
        self.config = ControllerConfig() if config is None else config
        self.remote, self.robot_mode, self.safety_mode = True, RobotMode.RUNNING, SafetyMode.NORMAL
        self.runtime = RuntimeState.STOPPED
        self.inputs: dict[str, float | int] = {f"input_int_register_{i}": 0 for i in range(_REGISTERS)}
        self.inputs |= {f"input_double_register_{i}": 0.0 for i in range(_REGISTERS)}
        self.owner: dict[str, object] = {}
        self._wrench, self._now_ns = wrench, 0
        self._measured, self._at = tuple(joints_rad), list(joints_rad)
        self._speed = [0.0] * JOINTS
        self._ints, self._doubles = [0] * _REGISTERS, [0.0] * _REGISTERS
        self._target: tuple[float, ...] | None = None
        self._lookahead_s = 0.1
        self._executing = self._stopping = False
        self._fed_ns, self._watchdog_ns, self._tripped_ns = 0, 0, 0
        self._fields: dict[str, Callable[[], Value]] = {
            "timestamp": lambda: self._now_ns * 1e-9, "actual_q": lambda: self._measured,
            "target_q": self.targets_rad, "actual_qd": lambda: tuple(self._speed),
            "target_qd": lambda: tuple(self._speed), "ft_raw_wrench": lambda: self._wrench(self._now_ns),
            "robot_mode": lambda: int(self.robot_mode), "safety_mode": lambda: int(self.safety_mode),
            "runtime_state": lambda: int(self.runtime), "robot_status_bits": self._status_bits,
            "safety_status_bits": lambda: _STATUS_BITS[self.safety_mode], "payload": lambda: self.config.payload_kg,
            "payload_cog": lambda: self.config.payload_cog_m, "tcp_offset": lambda: self.config.tcp_offset,
            "actual_TCP_pose": lambda: tool_pose(self.config.arm, self._measured, self.config.tcp_offset),
        }  # fmt: skip

    def _status_bits(self) -> int:
        powered = int(self.robot_mode is RobotMode.RUNNING)
        return powered | 2 * (self.runtime is RuntimeState.PLAYING)

    def targets_rad(self) -> tuple[float, ...]:
        """Return the joint angles that the servos hold, (6,)."""
        return tuple(self._at)

    def measured_rad(self, joints_rad: tuple[float, ...]) -> None:
        """Set the joint angles, (6,)."""
        self._measured = joints_rad

    @property
    def stationary(self) -> bool:
        """Return True if all joints are stationary."""
        return not any(self._speed)

    def step(self, now_ns: int) -> None:
        """Execute one control cycle of 2 ms."""
        self._now_ns = now_ns
        if self.runtime is RuntimeState.PLAYING:
            self._program()
            if self._watchdog_ns and now_ns - self._fed_ns > self._watchdog_ns:
                self.end_program()
        self._move()

    def write(self, name: str, value: float | int) -> None:
        """Set an input register."""
        if name in self.inputs:
            self.inputs[name] = value
            if name == "input_int_register_0":
                self._fed_ns = self._now_ns

    def read(self, name: str) -> Value | None:
        """Return an output field, or None if this controller does not have it."""
        kind, _, index = name.rpartition("_register_")
        if index.isdecimal() and int(index) < _REGISTERS:
            number = int(index)
            outputs = {"output_int": self._ints[number], "output_double": self._doubles[number]}
            return outputs.get(kind, self.inputs.get(name))
        return self._fields[name]() if name in self._fields else None

    def run_script(self, text: bytes) -> None:
        """Start the control program if remote control, power and safety allow it."""
        allowed = self.remote and self.robot_mode is RobotMode.RUNNING and self.safety_mode is SafetyMode.NORMAL
        if allowed and text.startswith(b"def ") and len(text) < _MOST_SCRIPT:
            self._target, self._executing, self._stopping, self._watchdog_ns = None, False, False, 0
            self._ints[0], self.runtime, self._fed_ns = _READY, RuntimeState.PLAYING, self._now_ns

    def end_program(self) -> None:
        """End the program; the joints brake."""
        self._target, self.runtime, self._watchdog_ns = None, RuntimeState.STOPPED, 0

    def protective_stop(self) -> None:
        """Enter a protective stop, as after a collision. The program pauses, and the arm keeps its power."""
        self.safety_mode, self._target, self._tripped_ns = SafetyMode.PROTECTIVE_STOP, None, self._now_ns
        if self.runtime is RuntimeState.PLAYING:
            self.runtime = RuntimeState.PAUSED

    def emergency_stop(self) -> None:
        """Press the emergency stop. The program ends, and the arm brakes and loses power."""
        self.end_program()
        self.safety_mode, self.robot_mode = SafetyMode.ROBOT_EMERGENCY_STOP, RobotMode.POWER_OFF

    def release(self) -> None:
        """Release the emergency stop. Power and brakes must then be switched on at the pendant."""
        self.safety_mode = SafetyMode.NORMAL

    def reboot(self) -> None:
        """Restart the controller, as after a power loss."""
        self.end_program()
        self.safety_mode, self.robot_mode = SafetyMode.NORMAL, RobotMode.POWER_OFF

    def dashboard(self, line: str) -> str:
        """Return the reply to a line sent to the dashboard server."""
        version = ".".join(map(str, self.config.version))
        if line in ("stop", "unlock protective stop") and not self.remote:
            return "Command is not allowed due to safety reasons: the robot is in local control"
        match line:
            case "PolyscopeVersion":
                return f"URSoftware {version} (Jan 01 2021)"
            case "get serial number":
                return self.config.serial
            case "is in remote control":
                return str(self.remote).lower()
            case "stop":
                self.end_program()
                return "Stopped"
            case "close safety popup":
                return "closing safety popup"
            case "unlock protective stop":
                if self._now_ns - self._tripped_ns < _UNLOCK_NS:
                    return "Cannot unlock protective stop until 5s after occurrence"
                self.safety_mode, self.runtime = SafetyMode.NORMAL, RuntimeState.STOPPED
                return "Protective stop releasing"
        return f"could not understand: '{line}'"

    def _program(self) -> None:
        """Run one pass of the control script's loop. Input register 0 holds commands, output register 0 answers."""
        command = int(self.inputs["input_int_register_0"])
        if command == _SERVO_J:
            requested = [float(self.inputs[f"input_double_register_{i}"]) for i in range(JOINTS)]
            if all(isfinite(angle) for angle in requested):
                self._target = tuple(requested)
            lookahead_s = float(self.inputs["input_double_register_9"])
            self._lookahead_s = min(max(lookahead_s, 0.03), 0.2) if isfinite(lookahead_s) else 0.2
            self._ints[0] = _READY
        elif command == 0:
            self._executing, self._ints[0] = False, _READY
        elif self._stopping:
            if self.stationary:
                self._stopping, self._ints[0] = False, _DONE
        elif not self._executing:
            self._executing = True
            self._regular(command)

    def _regular(self, command: int) -> None:
        if command == _END:
            self.end_program()
            return
        if command == _SERVO_STOP:
            self._target, self._stopping = None, True
            return
        if command == _WATCHDOG:
            rate_Hz = float(self.inputs["input_double_register_0"])
            self._watchdog_ns = round(1e9 / rate_Hz) if isfinite(rate_Hz) and rate_Hz > 0.01 else 0
        elif command == _TCP_OFFSET:
            self._doubles[:JOINTS] = self.config.tcp_offset
        elif command == _PROTECTIVE:
            self.protective_stop()
        self._ints[0] = _DONE

    def _move(self) -> None:
        target, most = self._target, (_STOP_RAD_S2 if self._target is None else _SERVO_RAD_S2) * _CYCLE_S
        for i in range(JOINTS):
            wanted = 0.0 if target is None else (target[i] - self._at[i]) / self._lookahead_s
            wanted = min(max(wanted, -_FASTEST_RAD_S), _FASTEST_RAD_S)
            speed = self._speed[i]
            self._speed[i] = speed + min(max(wanted - speed, -most), most)
            self._at[i] += self._speed[i] * _CYCLE_S
