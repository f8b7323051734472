"""An RTDE version 2 client session, with packages, recipes and data. It uses no sockets."""

import struct
from typing import Final

from palpate.simulation.emulators.ur.controller import CYCLE_NS, UrController, Value

_VERSION, _CONTROLLER, _TEXT, _DATA = ord("V"), ord("v"), ord("M"), ord("U")
_OUTPUTS, _INPUTS, _START, _PAUSE = ord("O"), ord("I"), ord("S"), ord("P")
_HEADER: Final = 3
_MOST_RECIPES: Final = 255
_FORMATS: Final = {"INT32": "i", "UINT32": "I", "DOUBLE": "d", "VECTOR3D": "3d", "VECTOR6D": "6d"}
_TYPES: Final = {
    "timestamp": "DOUBLE", "actual_q": "VECTOR6D", "target_q": "VECTOR6D", "actual_qd": "VECTOR6D",
    "target_qd": "VECTOR6D", "ft_raw_wrench": "VECTOR6D", "robot_mode": "INT32", "safety_mode": "INT32",
    "runtime_state": "UINT32", "robot_status_bits": "UINT32", "safety_status_bits": "UINT32", "payload": "DOUBLE",
    "payload_cog": "VECTOR3D", "tcp_offset": "VECTOR6D", "actual_TCP_pose": "VECTOR6D",
}  # fmt: skip


def _package(kind: int, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", _HEADER + len(payload), kind) + payload


def _names(payload: bytes) -> list[str]:
    return [name for name in payload.decode("latin-1").split(",") if name]


class RtdeSession:
    """A client session. An invalid package ends the session, and the client is then disconnected."""

    def __init__(self, controller: UrController) -> None:
        self.is_broken = False
        self._controller, self._buffer = controller, b""
        self._outputs: list[str] = []
        self._recipes: list[list[str]] = []
        self._started, self._period_ns, self._due_ns = False, CYCLE_NS, 0

    def receive(self, data: bytes) -> bytes:
        """Return the reply to bytes from the client."""
        self._buffer += data
        answer = b""
        while len(self._buffer) >= _HEADER and not self.is_broken:
            size, kind = struct.unpack_from(">HB", self._buffer)
            if size < _HEADER:
                self.is_broken = True
            elif len(self._buffer) < size:
                break
            else:
                payload, self._buffer = self._buffer[_HEADER:size], self._buffer[size:]
                answer += self._answer(kind, payload)
        return answer

    def due(self, now_ns: int) -> bytes:
        """Return the data package for this cycle, if there is one."""
        if not self._started or now_ns + CYCLE_NS // 2 < self._due_ns:
            return b""
        is_late = now_ns - self._due_ns > self._period_ns
        self._due_ns = (now_ns if is_late else self._due_ns) + self._period_ns
        return _package(_DATA, b"\x01" + b"".join(self._packed(name) for name in self._outputs))

    def close(self) -> None:
        """Close the session and free its registers."""
        owner = self._controller.owner
        for name in [name for name, session in owner.items() if session is self]:
            del owner[name]

    def _packed(self, name: str) -> bytes:
        value: Value | None = self._controller.read(name)
        values = value if isinstance(value, tuple) else (value,)
        return struct.pack(f">{_FORMATS[self._type(name)]}", *values)

    def _type(self, name: str) -> str:
        if self._controller.read(name) is None:
            return "NOT_FOUND"
        return _TYPES.get(name) or ("INT32" if "_int_" in name else "DOUBLE")

    def _answer(self, kind: int, payload: bytes) -> bytes:
        if kind == _VERSION and len(payload) == 2:
            return _package(_VERSION, bytes([int.from_bytes(payload, "big") == 2]))
        if kind == _CONTROLLER:
            return _package(_CONTROLLER, struct.pack(">4I", *self._controller.config.version))
        if kind == _OUTPUTS and len(payload) >= 8:
            return self._set_up_outputs(payload)
        if kind == _INPUTS:
            return self._set_up_inputs(_names(payload))
        if kind == _START:
            self._started = bool(self._outputs)
            return _package(_START, bytes([self._started]))
        if kind == _PAUSE:
            self._started = False
            return _package(_PAUSE, b"\x01")
        if kind == _DATA:
            self._take(payload)
            return b""
        text, source = f"package of type {kind} was not expected", b"RTDE"
        return _package(_TEXT, bytes([len(text)]) + text.encode() + bytes([len(source)]) + source + b"\x02")

    def _set_up_outputs(self, payload: bytes) -> bytes:
        (rate_Hz,) = struct.unpack_from(">d", payload)
        names = _names(payload[8:])
        types = [self._type(name) for name in names]
        found = bool(names) and "NOT_FOUND" not in types and 1.0 <= rate_Hz <= 500.0
        if found:
            self._outputs, self._period_ns = names, round(1e9 / rate_Hz)
        return _package(_OUTPUTS, (bytes([found]) + ",".join(types).encode())[: 0xFFFF - _HEADER])

    def _set_up_inputs(self, names: list[str]) -> bytes:
        owner, inputs, types = self._controller.owner, self._controller.inputs, []
        for name in names:
            taken = owner.get(name, self) is not self
            kind = "INT32" if "_int_" in name else "DOUBLE"
            types.append("NOT_FOUND" if name not in inputs else "IN_USE" if taken else kind)
        found = bool(names) and not {"NOT_FOUND", "IN_USE"} & set(types) and len(self._recipes) < _MOST_RECIPES
        if found:
            self._recipes.append(names)
            owner |= dict.fromkeys(names, self)
        number = len(self._recipes) if found else 0
        return _package(_INPUTS, (bytes([number]) + ",".join(types).encode())[: 0xFFFF - _HEADER])

    def _take(self, payload: bytes) -> None:
        if not payload or not 1 <= payload[0] <= len(self._recipes):
            return
        names = self._recipes[payload[0] - 1]
        layout = ">" + "".join("i" if "_int_" in name else "d" for name in names)
        if struct.calcsize(layout) == len(payload) - 1:
            # The command is written last, so that its arguments are there when it is read.
            for name, value in reversed(list(zip(names, struct.unpack_from(layout, payload, 1), strict=True))):
                self._controller.write(name, value)
