"""A serial port is one program's, and late only when it takes no bytes."""

import os
import pty
import select

import pytest
import serial

from palpate.drivers.errors import WiringError
from palpate.drivers.serial_port import close_serial, open_serial, write_unless_stuck


def test_port_that_is_in_use_is_refused():
    master, slave = pty.openpty()
    name = os.ttyname(slave)
    first = open_serial(name, 9600, "arm")
    with pytest.raises(WiringError, match="that no other program has"):
        open_serial(name, 9600, "arm")
    close_serial(first)
    close_serial(open_serial(name, 9600, "arm"))
    os.close(master)
    os.close(slave)


@pytest.fixture
def ends():
    """Both ends of a line; the port counts as late as soon as time goes on at all."""
    master, slave = pty.openpty()
    port = open_serial(os.ttyname(slave), 9600, "arm")
    port.write_timeout = 1e-9
    yield master, port
    close_serial(port)
    os.close(master)
    os.close(slave)


def test_program_that_was_held_up_has_written_all_the_same(ends):
    master, port = ends
    with pytest.raises(serial.SerialTimeoutException):
        port.write(b"as pyserial has it")
    write_unless_stuck(port, b", and as it is")
    written = b"as pyserial has it, and as it is"
    came = b""
    # The kernel makes pieces of its own, and passes them on when it comes to it.
    while len(came) < len(written) and select.select([master], [], [], 30.0)[0]:
        came += os.read(master, 100)
    assert came == written


def test_port_that_takes_no_bytes_is_late(ends):
    _, port = ends

    def fill():
        for _ in range(1000):
            write_unless_stuck(port, bytes(1024))

    with pytest.raises(serial.SerialTimeoutException):
        fill()
