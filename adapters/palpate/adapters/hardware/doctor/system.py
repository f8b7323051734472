"""What the operating system shows of a wire, before and after it is used."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from serial.tools.list_ports import comports

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.wiring import Wiring

_IFF_UP: Final = 0x1
_SHORT_QUEUE: Final = 10
"""Frames: the kernel's own setting for CAN. A cycle over six drives alone hands over seven at once."""
_LATENCY_MS: Final = 1
_TERMINATOR: Final = "measure 60 ohm between CAN_H and CAN_L with the power off: a resistor of 120 ohm at each end"
_ERRORS: Final = ("rx_errors", "tx_errors", "rx_over_errors", "tx_dropped")


def existing_ports() -> tuple[str, ...]:
    """Serial ports of this computer."""
    return tuple(sorted(port.device for port in comports()))


@dataclass(frozen=True)
class System:
    """The operating system's own files, and questions about them."""

    root: Path = Path("/")
    ports: Callable[[], tuple[str, ...]] = existing_ports
    may_open: Callable[[str], bool] = lambda path: os.access(path, os.R_OK | os.W_OK)

    def examine(self, wiring: Wiring, notes: Notebook) -> bool:
        """Whether the wire is there and may be used; what is in the way, and what slows it down, is taken down."""
        usable = True
        if wiring.serial is not None and wiring.serial.startswith("/"):
            usable = self._serial(wiring.serial, notes)
        if wiring.network is not None:
            usable = self._network(wiring.network, notes)
        return usable

    def errors_of(self, wiring: Wiring) -> dict[str, int]:
        """Error counters of a CAN interface; empty for any other wire."""
        if wiring.network is None:
            return {}
        folder = self.root / "sys/class/net" / wiring.network / "statistics"
        counts = {name: _number(folder / name) for name in _ERRORS}
        return {name: count for name, count in counts.items() if count is not None}

    def examine_after(self, wiring: Wiring, before: dict[str, int], notes: Notebook) -> None:
        """What has become of a CAN interface while it was used."""
        if wiring.network is None:
            return
        folder = self.root / "sys/class/net" / wiring.network
        if _is_up(folder) and _number(folder / "carrier") == 0:
            remedy = f"{_TERMINATOR}; then ip link set {wiring.network} down and up"
            notes.wrong(f"{wiring.network} is off the bus (bus-off) after too many errors", remedy)
        grown = {name: count - before.get(name, 0) for name, count in self.errors_of(wiring).items()}
        told = ", ".join(f"{count} {name}" for name, count in grown.items() if count > 0)
        if told:
            remedy = f"{_TERMINATOR}; check that every node has the same bit rate: ip -details link show"
            notes.wrong(f"{wiring.network} counted {told} meanwhile", remedy)
        elif grown:
            notes.ok(f"{wiring.network} counted no errors")

    def suspect_another_device(self, wiring: Wiring, notes: Notebook) -> None:
        """Nobody, or nobody who makes sense, answers: perhaps the rig file names the port of another device."""
        if wiring.serial is not None:
            remedy = f"see which adapter is which in /dev/serial/by-id, and try another port; {self._there()}"
            notes.note(f"another device may be behind {wiring.serial}", remedy)

    def _there(self) -> str:
        return f"there are: {', '.join(self.ports()) or 'none'}"

    def _serial(self, path: str, notes: Notebook) -> bool:
        if not os.path.exists(path):
            notes.wrong(f"there is no {path}", f"plug it in, or name another in the rig file; {self._there()}")
            return False
        if not self.may_open(path):
            remedy = "sudo usermod -aG dialout $USER, then log in anew"
            notes.wrong(f"this user may not open {path} (permission denied, EACCES)", remedy)
            return False
        self._latency(path, notes)
        return True

    def _latency(self, path: str, notes: Notebook) -> None:
        # A link of /dev/serial/by-id leads to the name that the driver uses.
        name = os.path.basename(os.path.realpath(path))
        setting = self.root / "sys/bus/usb-serial/devices" / name / "latency_timer"
        latency_ms = _number(setting)
        if latency_ms is None:
            return
        notes.fact("latency timer", f"{latency_ms} ms")
        if latency_ms > _LATENCY_MS:
            remedy = f'echo {_LATENCY_MS} | sudo tee {setting}; or for good by a udev rule: ATTR{{latency_timer}}="1"'
            notes.wrong(f"the USB adapter of {path} holds what it receives back for up to {latency_ms} ms", remedy)
        else:
            notes.ok(f"the latency timer of {path} is {latency_ms} ms")

    def _network(self, name: str, notes: Notebook) -> bool:
        folder = self.root / "sys/class/net" / name
        if not folder.exists():
            there = ", ".join(sorted(path.name for path in folder.parent.glob("*can*"))) or "none"
            remedy = f"plug the adapter in, load its driver, or name another in the rig file; CAN interfaces: {there}"
            notes.wrong(f"there is no CAN interface {name}", remedy)
            return False
        if not _is_up(folder):
            remedy = f"sudo ip link set {name} up type can bitrate 1000000 restart-ms 100"
            notes.wrong(f"the CAN interface {name} is down", remedy)
            return False
        queue = _number(folder / "tx_queue_len")
        if queue is not None:
            notes.fact("send queue", f"{queue} frames")
            if queue <= _SHORT_QUEUE:
                remedy = f"sudo ip link set {name} txqueuelen 1000"
                notes.note(f"the send queue of {name} holds only {queue} frames and may overflow", remedy)
        return True


def _is_up(folder: Path) -> bool:
    try:
        return bool(int((folder / "flags").read_text(), 16) & _IFF_UP)
    except (OSError, ValueError):
        return False


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):
        return None
