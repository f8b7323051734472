"""A serial port is one program's."""

import os
import pty

import pytest

from palpate.drivers.errors import WiringError
from palpate.drivers.serial_port import close_serial, open_serial


def test_a_port_that_is_in_use_is_refused() -> None:
    master, slave = pty.openpty()
    name = os.ttyname(slave)
    first = open_serial(name, 9600, "arm")
    with pytest.raises(WiringError, match="that no other program has"):
        open_serial(name, 9600, "arm")
    close_serial(first)
    close_serial(open_serial(name, 9600, "arm"))
    os.close(master)
    os.close(slave)
