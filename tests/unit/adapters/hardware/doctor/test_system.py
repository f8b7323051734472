from pathlib import Path

import pytest

from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.system import System
from palpate.adapters.hardware.doctor.wiring import Wiring
from tests.unit.adapters.hardware.doctor.notebook import told


@pytest.fixture
def notes() -> Notebook:
    return Notebook("device")


@pytest.fixture
def port(tmp_path: Path) -> str:
    path = tmp_path / "ttyUSB0"
    path.touch()
    return str(path)


def system(root: Path) -> System:
    return System(root, lambda: ("/dev/ttyS0", "/dev/ttyUSB7"))


def latency(root: Path, text: str) -> None:
    folder = root / "sys/bus/usb-serial/devices/ttyUSB0"
    folder.mkdir(parents=True)
    (folder / "latency_timer").write_text(text)


def interface(root: Path, **files: str) -> Path:
    folder = root / "sys/class/net/can0"
    (folder / "statistics").mkdir(parents=True)
    usual = {"flags": "0x40081\n", "tx_queue_len": "1000\n", "carrier": "1\n"}
    for name, text in {**usual, **files}.items():
        (folder / name).write_text(text)
    for name in ("rx_errors", "tx_errors"):
        (folder / "statistics" / name).write_text("2\n")
    return folder


def test_a_missing_port_is_told_with_those_that_exist(tmp_path: Path, notes: Notebook) -> None:
    assert not system(tmp_path).examine(Wiring("/dev/ttyUSB42"), notes)
    (line,) = told(notes, Level.WRONG)
    assert "there is no /dev/ttyUSB42" in line
    assert "/dev/ttyS0, /dev/ttyUSB7" in line


def test_a_port_without_permission(tmp_path: Path, notes: Notebook, port: str) -> None:
    assert not System(tmp_path, may_open=lambda path: False).examine(Wiring(port), notes)
    (line,) = told(notes, Level.WRONG)
    assert "EACCES" in line
    assert "dialout" in line


@pytest.mark.parametrize(("text", "wrong"), [("16\n", True), ("1\n", False)])
def test_the_latency_timer(tmp_path: Path, notes: Notebook, port: str, text: str, wrong: bool) -> None:
    latency(tmp_path, text)
    assert system(tmp_path).examine(Wiring(port), notes)
    lines = told(notes, Level.WRONG)
    assert bool(lines) == wrong
    if lines:
        assert "up to 16 ms" in lines[0]
        assert "echo 1 | sudo tee" in lines[0]


@pytest.mark.parametrize("name", ["loop://", "socket://10.0.0.1:4000"])
def test_a_port_that_is_no_file_is_left_to_the_driver(tmp_path: Path, notes: Notebook, name: str) -> None:
    assert system(tmp_path).examine(Wiring(name), notes)
    assert not notes.section().findings


def test_a_missing_interface_is_told_with_those_that_exist(tmp_path: Path, notes: Notebook) -> None:
    interface(tmp_path)
    assert not system(tmp_path).examine(Wiring(network="can5"), notes)
    (line,) = told(notes, Level.WRONG)
    assert "CAN interfaces: can0" in line


def test_an_interface_that_is_down(tmp_path: Path, notes: Notebook) -> None:
    interface(tmp_path, flags="0x40080\n")
    assert not system(tmp_path).examine(Wiring(network="can0"), notes)
    (line,) = told(notes, Level.WRONG)
    assert "sudo ip link set can0 up" in line


def test_a_short_send_queue_is_noted(tmp_path: Path, notes: Notebook) -> None:
    interface(tmp_path, tx_queue_len="10\n")
    assert system(tmp_path).examine(Wiring(network="can0"), notes)
    (line,) = told(notes, Level.NOTE)
    assert "txqueuelen 1000" in line


def test_errors_that_grow_point_at_the_terminator(tmp_path: Path, notes: Notebook) -> None:
    folder, wiring, here = interface(tmp_path), Wiring(network="can0"), system(tmp_path)
    before = here.errors_of(wiring)
    (folder / "statistics" / "tx_errors").write_text("9\n")
    here.examine_after(wiring, before, notes)
    (line,) = told(notes, Level.WRONG)
    assert "7 tx_errors" in line
    assert "60 ohm" in line


def test_old_errors_are_not_held_against_it(tmp_path: Path, notes: Notebook) -> None:
    interface(tmp_path)
    wiring, here = Wiring(network="can0"), system(tmp_path)
    here.examine_after(wiring, here.errors_of(wiring), notes)
    assert told(notes, Level.OK) == ["can0 counted no errors -> "]


def test_bus_off(tmp_path: Path, notes: Notebook) -> None:
    interface(tmp_path, carrier="0\n")
    wiring, here = Wiring(network="can0"), system(tmp_path)
    here.examine_after(wiring, here.errors_of(wiring), notes)
    (line,) = told(notes, Level.WRONG)
    assert "bus-off" in line


def test_another_device_is_suspected_with_the_ports_that_exist(tmp_path: Path, notes: Notebook) -> None:
    system(tmp_path).suspect_another_device(Wiring("/dev/ttyUSB0"), notes)
    system(tmp_path).suspect_another_device(Wiring(network="can0"), notes)
    (line,) = told(notes, Level.NOTE)
    assert "/dev/serial/by-id" in line
    assert "/dev/ttyUSB7" in line
