"""Bringing a bus up, in order and out of order."""

import pytest

from palpate.drivers.errors import SilentError, WiringError
from palpate.drivers.nmc import NOP, BusSettings, NmcBus, Reply, StatusItem, StopControl, attach, start, stop_motor
from palpate.drivers.nmc.settings import BAUD_DIVISORS
from tests.unit.drivers.nmc.line import Line, Module


def bus_on(line, **settings):
    return NmcBus(line, line.clock, line.clock.sleep, BusSettings(**settings))


@pytest.mark.parametrize("left_at", BAUD_DIVISORS)
def test_start_from_any_rate(left_at):
    line = Line()
    for number, module in enumerate(line.modules, start=7):
        module.baud, module.address, module.mask = left_at, number, 0xFF
    modules = start(bus_on(line))
    assert [module.address for module in modules] == [1, 2, 3, 4, 5, 6]
    assert {module.identity.name for module in modules} == {"servo, firmware 10"}
    assert {module.baud for module in line.modules} == {line.baudrate} == {115_200}


def test_start_follows_the_documented_order():
    line = Line([Module()])
    start(bus_on(line))
    sent = b"".join(line.sent)
    reset = bytes.fromhex("aaff0f0e")
    assert line.modules[0].resets >= 2
    assert bytes(20) + reset + reset in sent
    assert sent.index(reset) < sent.index(bytes.fromhex("aa002101ff21")) < sent.index(bytes.fromhex("aaff1a0a23"))
    assert sum(wait >= 0.1 for wait in line.clock.slept_s) >= 2


@pytest.mark.parametrize("lost", range(1, 7))
def test_lost_reply_in_the_chain_gives_no_two_modules_one_address(lost):
    line = Line()
    replies = []

    def mangle(reply):
        replies.append(reply)
        return [] if len(replies) == lost else [(0.0, reply)]

    line.mangle = mangle
    start(bus_on(line))
    assert [module.address for module in line.modules] == [1, 2, 3, 4, 5, 6]


def test_replies_that_come_late_are_no_more_modules():
    for late_ms in range(20, 200, 6):
        line = Line()
        # A converter that was busy: it hands over a little later from reply to reply until all is as it should be.
        delays = iter((late_ms * 1e-3, late_ms * 0.5e-3))
        line.mangle = lambda reply, delays=delays: [(next(delays, 0.0), reply)]
        modules = start(bus_on(line))
        assert [module.address for module in modules] == [1, 2, 3, 4, 5, 6], late_ms


def test_nobody_there():
    line = Line([])
    with pytest.raises(WiringError, match="no module answers at any of 19200, 57600"):
        start(bus_on(line))


def test_somebody_at_another_rate_who_does_not_obey_the_reset():
    class Stubborn(Module):
        def reset(self):
            pass

    line = Line([Stubborn(address=1, baud=57_600)])
    with pytest.raises(WiringError, match="somebody answers at 57600"):
        start(bus_on(line))


def test_modules_that_do_not_follow_the_change_of_rate():
    class Slow(Module):
        def obey(self, code, data):
            return None if code == 0xA else super().obey(code, data)

    line = Line([Slow(), Slow()])
    with pytest.raises(WiringError, match="the modules answer at 19200"):
        start(bus_on(line))
    line = Line([Module(), Slow(), Module()])
    with pytest.raises(SilentError, match="no answer from module 2"):
        start(bus_on(line))


def test_echo():
    line = Line([])
    line.is_echo = True
    with pytest.raises(WiringError, match="comes back"):
        start(bus_on(line))
    with pytest.raises(WiringError, match="comes back"):
        attach(bus_on(line), 6)


def test_port_gone_at_start():
    line = Line()
    line.gone = OSError(5, "unplugged")
    with pytest.raises(SilentError, match="gone"):
        start(bus_on(line))


def test_attach_changes_nothing():
    line = Line()
    start(bus_on(line))
    for module in line.modules:
        module.counts = module.target = 77
        module.is_on, module.mask = True, 0x1F
        module.seen.clear()
    modules = attach(bus_on(line), 6)
    assert len(modules) == 6
    assert {code for module in line.modules for code, _ in module.seen} == {0x3}
    assert all(module.counts == 77 and module.is_on for module in line.modules)


def test_attach_finds_another_rate_and_changes_it():
    line = Line()
    start(bus_on(line, baud=57_600))
    assert attach(bus_on(line), 6)
    assert {module.baud for module in line.modules} == {115_200}


def test_attach_to_fresh_modules_finds_none():
    assert attach(bus_on(Line()), 6) is None


def test_attach_when_one_module_was_reset():
    line = Line()
    start(bus_on(line))
    line.modules[3].reset()
    with pytest.raises(SilentError, match="module 4"):
        attach(bus_on(line), 6)


def test_masks_are_forgotten_at_a_start():
    line = Line([Module()])
    bus = bus_on(line)
    start(bus)
    assert isinstance(bus.exchange(1, NOP), Reply)
    assert bus.exchange(1, stop_motor(StopControl.AMP_ENABLE | StopControl.ABRUPT)).position_counts is None
    assert StatusItem(line.modules[0].mask) == StatusItem(0)
