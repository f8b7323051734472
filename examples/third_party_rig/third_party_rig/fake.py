"""A fake arm and a fake force sensor, both of which serve their links over TCP.

    python -m third_party_rig.fake --rig-file rig.toml     both devices in front of palpate's simulated work cell

The checks use the same devices with a simple plant and a separate clock.
"""

from __future__ import annotations

import argparse
import selectors
import shutil
import socket
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from palpate.adapters.config import RunConfig
from palpate.adapters.hardware import MonotonicClock
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.ports import CONTROL_RATE_HZ, Clock
from palpate.core.trial import find_ready_pose

POWER_UP_NS = 7_000_000_000
"""Time between switching on the devices and the start of the run's clock."""


class FakeDevice:
    """A fake device that sends a sample at each call of ``tick``, and serves its clients in a thread.

    Args:
        kind: Name of the device in its greeting.
        clock: Clock with the same rate as the device's clock, but a different zero.
        values: Function that returns the current measurement.
        command: Function that receives a command, ``G`` with numbers or ``S``.
    """

    def __init__(
        self, kind: str, clock: Clock, values: Callable[[], Sequence[float]],
        command: Callable[[str, tuple[float, ...]], None] = lambda word, numbers: None,
    ) -> None:  # fmt: skip
        self._kind, self._clock, self._values, self._command = kind, clock, values, command
        self._lock, self._number, self.silent = threading.RLock(), 0, False
        self._clients: dict[socket.socket, bool] = {}
        self.address: tuple[str, int] = ("127.0.0.1", 0)
        self.plug_in()

    def plug_in(self) -> None:
        """Start listening, at the previous address if there was one."""
        self._listener = socket.create_server(self.address)
        self.address = self._listener.getsockname()
        self._watched, self._ended = selectors.DefaultSelector(), False
        self._watched.register(self._listener, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._serve, name=f"fake {self._kind}", daemon=True)
        self._thread.start()

    def tick(self) -> None:
        """Advance one tick: process the received commands, then send a new sample."""
        with self._lock:
            self.take_in()
            self._number += 1
            for client in [client for client, begun in self._clients.items() if begun and not self.silent]:
                self._send(client, self._sample())

    def take_in(self) -> None:
        """Process all commands received so far."""
        with self._lock:
            for client in list(self._clients):
                self._hear(client)

    def fail(self, text: str) -> None:
        """Report a fault of the device."""
        with self._lock:
            self._command("S", ())
            for client in self._clients:
                self._send(client, f"F {text}")

    def close(self) -> None:
        """Close all connections, as if the cable were cut."""
        self._ended = True
        self._thread.join()
        with self._lock:
            self._listener.close()
            for client in list(self._clients):
                self._drop(client)
        self._watched.close()

    def _serve(self) -> None:
        while not self._ended:
            for key, _ in self._watched.select(0.005):
                with self._lock:
                    if key.fileobj is self._listener:
                        self._greet(self._listener.accept()[0])
                    elif key.fileobj in self._clients:  # else a tick has heard that it went
                        self._hear(key.fileobj)  # type: ignore[arg-type]

    def _greet(self, client: socket.socket) -> None:
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[client] = False
        self._watched.register(client, selectors.EVENT_READ)
        self._send(client, f"HELLO {self._kind} {len(self._values())}")

    def _hear(self, client: socket.socket) -> None:
        """Process the input from a client. Commands are short, so each line arrives in one piece."""
        try:
            said = client.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            said = b""
        for line in said.decode("ascii").splitlines():
            word, *numbers = line.split()
            if word in "BE":
                self._clients[client] = word == "B"
            self._command(word, tuple(map(float, numbers)))
            if word == "B":
                self._send(client, self._sample())
        if not said:
            self._drop(client)

    def _sample(self) -> str:
        microseconds = (self._clock.now_ns() + POWER_UP_NS) // 1000
        return f"T {self._number} {microseconds} " + " ".join(map(repr, map(float, self._values())))

    def _send(self, client: socket.socket, line: str) -> None:
        try:
            client.send(line.encode("ascii") + b"\n")
        except OSError:
            # Gone, or so far behind that its buffer is full: a device does not wait.
            return

    def _drop(self, client: socket.socket) -> None:
        self._command("S", ())
        # No longer watched before it is closed: the next client may be given its number.
        self._watched.unregister(client)
        del self._clients[client]
        client.close()


class FakeServos:
    """Joint set-points that take effect one tick after a request. Every command except ``G`` discards a pending one."""

    def __init__(self, home_rad: Sequence[float]) -> None:
        self.held_rad = self._told_rad = tuple(home_rad)
        self._enabled = False

    def command(self, word: str, numbers: tuple[float, ...]) -> None:
        """Process a command from the arm's client."""
        if word != "G":
            self._enabled, self._told_rad = word == "B", self.held_rad
        elif self._enabled and len(numbers) == len(self.held_rad):
            self._told_rad = numbers

    def turn_by_hand(self, position_rad: Sequence[float]) -> None:
        """Move the joints to a position as if by hand."""
        self.held_rad = self._told_rad = tuple(position_rad)

    def tick(self) -> None:
        """Advance one tick."""
        self.held_rad = self._told_rad


def serve(rig_file: Path, ended: threading.Event) -> None:
    """Serve both devices with the simulated cell, in real time, until the event is set."""
    config, clock = RunConfig(), MonotonicClock()
    example = (Path(__file__).parent / "rig.toml").read_text(encoding="utf-8")
    with SimulatedRig(config, find_ready_pose(config.arm, config.tool.geometry, config.task)) as rig:
        rig.prepare(0)
        cell = rig.cell
        joints, wrench = tuple(cell.joint_angles()), tuple(cell.measure_wrench())
        servos = FakeServos(joints)
        arm = FakeDevice("bench-arm", clock, lambda: joints, servos.command)
        sensor = FakeDevice("bench-force", clock, lambda: wrench)
        ports = {"5800": str(arm.address[1]), "5801": str(sensor.address[1])}
        for known, here in ports.items():
            example = example.replace(f"port = {known}", f"port = {here}")
        shutil.copy(Path(__file__).parent / "job.toml", rig_file.parent)
        rig_file.write_text(example, encoding="utf-8")
        print(f"serving; {rig_file} is the rig file; end with Ctrl-C", flush=True)
        start_ns, tick = clock.now_ns(), 0
        while not ended.is_set():
            arm.take_in()
            servos.tick()
            cell.command(servos.held_rad)
            cell.advance()
            joints, wrench = tuple(cell.joint_angles()), tuple(cell.measure_wrench())
            arm.tick()
            sensor.tick()
            tick += 1
            clock.sleep_until(start_ns + tick * 1_000_000_000 // CONTROL_RATE_HZ)
        arm.close()
        sensor.close()


def main() -> None:
    """Parse the command line, and serve both devices."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig-file", type=Path, required=True, help="file to write, with the ports of both devices")
    ended = threading.Event()
    try:
        serve(parser.parse_args().rig_file, ended)
    except KeyboardInterrupt:
        ended.set()


if __name__ == "__main__":
    main()
