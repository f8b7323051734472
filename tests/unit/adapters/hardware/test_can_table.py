"""What a rig file gives to python-can, and what comes of interfaces that are not there."""

import can
import pytest
from can.interfaces.virtual import VirtualBus

from palpate.adapters.config import overlay
from palpate.adapters.hardware.cia402 import Cia402Table
from palpate.adapters.hardware.jr3 import Jr3CanTable, open_jr3_bus
from palpate.drivers.can.link import open_bus
from palpate.drivers.errors import WiringError


def test_table_can_goes_to_python_can_as_it_is(monkeypatch):
    given = []

    def opened(**options):
        given.append(options)
        return VirtualBus("any")

    monkeypatch.setattr(can, "Bus", opened)
    own = {"interface": "kvaser", "channel": 0, "single_handle": True, "nested": {"a": [1]}}
    open_jr3_bus(overlay(Jr3CanTable(), {"can": own})).shutdown()
    assert given == [{"bitrate": 1_000_000, **own}]
    table = overlay(Cia402Table(), {"channel": "can1", "can": {"bitrate": 500_000}})
    assert table.bus == {"interface": "socketcan", "channel": "can1", "bitrate": 500_000}


@pytest.mark.parametrize(
    ("interface", "message"),
    [
        ("kvaser", "library of its maker is missing .CANlib, .* install it"),
        ("neovi", "python-ics"),
        ("slcan", "CAN bus slcan 0: cannot be opened"),
        ("no-such-interface", "CAN bus no-such-interface 0: cannot be opened"),
        ("socketcand", "give python-can what .* .arm.can."),
    ],
)
def test_interface_that_is_not_there_is_one_line(interface, message, capfd):
    with pytest.raises(WiringError, match=message) as caught:
        open_bus(interface, "0", 1_000_000)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
