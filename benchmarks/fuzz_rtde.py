"""Fuzzing of the emulated Universal Robots controller with arbitrary messages from clients, in pieces of any size.

    python -m benchmarks.fuzz_rtde --seconds 600
    python -m benchmarks.fuzz_rtde --seconds 5 --first-seed 7

Each seed generates a conversation with two clients: valid and almost valid packages, some truncated, joined, corrupted
and repeated, in pieces of any size, with control cycles in between; dashboard lines; and scripts. No exception may be
raised. Answers and streams must be complete packages, independent of the pieces. The joints must stay finite and within
their speed limit, and a closed session must free its registers. The first finding ends the run and prints its seed.
"""

from __future__ import annotations

import random
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from copy import deepcopy

from benchmarks.fuzzing import drawn, require
from palpate.simulation.emulators.ur import RtdeSession, UrController

CYCLE_NS = 2_000_000
HOME = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
OUTPUTS = (
    "timestamp", "actual_q", "ft_raw_wrench", "runtime_state", "safety_mode", "payload_cog", "output_int_register_0",
    "output_double_register_47", "tcp_offset", "nonsense", "output_int_register_99", "output_int_register_-1", "",
)  # fmt: skip
INPUTS = (
    "input_int_register_0", "input_int_register_1", "input_double_register_0", "input_double_register_9",
    "input_double_register_5", "input_int_register_x", "nonsense", "",
)  # fmt: skip
LINES = (
    "PolyscopeVersion", "get serial number", "is in remote control", "robotmode", "safetystatus", "stop", "power on",
    "brake release", "close safety popup", "unlock protective stop", "quit", "",
)  # fmt: skip
SERVO = ",".join(["input_int_register_0", *(f"input_double_register_{i}" for i in range(11))])
NUMBERS = (0.0, -0.0, 1.0, -1.0, 10.0, 1e308, -1e308, 5e-324, float("nan"), float("inf"), float("-inf"))
COMMANDS = (0, 11, 16, 31, 35, 40, 99, 255, -1, 2**31 - 1, -(2**31))


def package(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", min(0xFFFF, 3 + len(payload)), ord(kind)) + payload


class Conversation:
    """A generated conversation of clients with a controller, and its effects."""

    def __init__(self, seed: int, seen: Counter[str]) -> None:
        self.draw, self.seen = random.Random(seed), seen
        self.controller = UrController(HOME, lambda now_ns: (0.0, 0.0, -5.0, 0.0, 0.0, 0.0))
        self.sessions = [RtdeSession(self.controller), RtdeSession(self.controller)]
        self.recipes: list[list[str]] = [[], []]
        self.now_ns, self.answered = 0, 0

    def names(self, known: tuple[str, ...]) -> bytes:
        return ",".join(self.draw.choices(known, k=self.draw.randrange(8))).encode()

    def number(self) -> float:
        return self.draw.choice(NUMBERS) if self.draw.random() < 0.2 else self.draw.uniform(-7, 7)

    def said(self, who: int) -> bytes:
        """Return a package, which is usually valid."""
        draw = self.draw
        kind = draw.choice("VvOISPUUUUM?")
        if kind == "V":
            return package("V", draw.choice([b"\0\2", b"\0\1", b"\0\3", b"", b"\0\2\0"]))
        if kind == "O":
            rate = struct.pack(">d", draw.choice([125.0, 500.0, 1.0, *NUMBERS]))
            return package("O", draw.choice([rate, rate, b""]) + self.names(OUTPUTS[: draw.choice([9, len(OUTPUTS)])]))
        if kind == "I":
            names = self.names(INPUTS[: draw.choice([5, len(INPUTS)])])
            self.recipes[who].append(names.decode())
            return package("I", names)
        if kind == "U":
            number = draw.randrange(0, len(self.recipes[who]) + 2)
            recipe = self.recipes[who][number - 1] if 0 < number <= len(self.recipes[who]) else "input_int_register_0"
            values = [
                struct.pack(">i", draw.choice(COMMANDS)) if "_int_" in name else struct.pack(">d", self.number())
                for name in recipe.split(",") if name
            ]  # fmt: skip
            return package("U", bytes([number]) + b"".join(values))
        return package(kind, draw.randbytes(draw.randrange(12)) if kind == "?" else b"")

    def spoilt(self, data: bytes) -> bytes:
        """Return the data, corrupted in one of eight cases."""
        draw = self.draw
        if not data or draw.random() > 0.125:
            return data
        at = draw.randrange(len(data))
        return draw.choice([
            data[:at], data[at:], data + data, data[:at] + bytes([data[at] ^ 1 << draw.randrange(8)]) + data[at + 1 :],
            draw.randbytes(draw.randrange(40)), data[:at] + draw.randbytes(3) + data[at:],
        ])  # fmt: skip

    def pieces(self, stream: bytes) -> Iterator[bytes]:
        while stream:
            size = self.draw.randrange(1, len(stream) + 1)
            yield stream[:size]
            stream = stream[size:]

    def hear(self, answer: bytes) -> None:
        """Require that an answer consists of complete packages."""
        while answer:
            require(len(answer) >= 3, "a whole header")
            size, kind = struct.unpack_from(">HB", answer)
            require(3 <= size <= len(answer), "a whole package")
            self.seen[chr(kind)] += 1
            answer = answer[size:]

    def cycles(self, count: int) -> None:
        for _ in range(count):
            before = self.controller.targets_rad()
            self.now_ns += CYCLE_NS
            self.controller.step(self.now_ns)
            steps_rad = [abs(a - b) for a, b in zip(before, self.controller.targets_rad(), strict=True)]
            require(all(step <= 3.15 * 2e-3 for step in steps_rad), "joints within their speed")
            for session in self.sessions:
                self.hear(session.due(self.now_ns))

    def run(self) -> None:
        draw, controller = self.draw, self.controller
        acts: list[Callable[[], object]] = [
            lambda: controller.run_script(draw.choice([b"def x():\nend\n", b"x", b"", draw.randbytes(9)])),
            controller.protective_stop, controller.emergency_stop, controller.release, controller.reboot,
            lambda: setattr(controller, "remote", draw.random() < 0.8),
        ]  # fmt: skip
        for who, session in enumerate(self.sessions):
            self.hear(session.receive(package("V", b"\0\2")))
            if draw.random() < 0.7:
                # As ur_rtde begins.
                rate = struct.pack(">d", draw.choice([125.0, 500.0]))
                self.hear(session.receive(package("O", rate + b"timestamp,actual_q,runtime_state") + package("S")))
                self.hear(session.receive(package("I", SERVO.encode())))
                self.recipes[who].append(SERVO)
        controller.run_script(b"def x():\nend\n")
        for _ in range(draw.randrange(1, 40)):
            who = draw.randrange(2)
            stream = self.spoilt(self.said(who))
            whole = deepcopy(self.sessions[who]).receive(stream)
            answers = b"".join(self.sessions[who].receive(piece) for piece in self.pieces(stream))
            require(answers == whole, "the same answers whatever the pieces")
            self.hear(answers)
            line = draw.choice(LINES) if draw.random() < 0.8 else draw.randbytes(8).decode("latin-1")
            require("\n" not in controller.dashboard(line.replace("\n", "")), "one line")
            if draw.random() < 0.1:
                draw.choice(acts)()
            if draw.random() < 0.05 or self.sessions[who].is_broken:
                self.seen["hung up"] += 1
                self.sessions[who].close()
                self.sessions[who], self.recipes[who] = RtdeSession(controller), []
            self.cycles(draw.choice([0, 1, 2, 3, 60]))
        for session in self.sessions:
            session.close()
        require(not controller.owner, "registers are free again")
        self.seen[f"runtime {controller.runtime.name}"] += 1


def main() -> None:
    seen: Counter[str] = Counter()
    drawn(__doc__, "conversations", lambda seed: Conversation(seed, seen).run(), seen)


if __name__ == "__main__":
    main()
