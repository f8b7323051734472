"""The NMC bus: replies that come late, short, twice, damaged, or not at all; bringing it up, in order and out of it."""

import pytest

from palpate.drivers.errors import GarbledError, LateError, SilentError, StateError, WiringError
from palpate.drivers.nmc import (
    NOP,
    BusSettings,
    NmcBus,
    Reply,
    StatusItem,
    StopControl,
    attach,
    def_stat,
    start,
    stop_motor,
)
from palpate.drivers.nmc.replies import Discarded
from palpate.drivers.nmc.settings import BAUD_DIVISORS
from tests.unit.drivers.nmc_line import Line, Module


def bus_on(line, **settings):
    return NmcBus(line, line.clock, line.clock.sleep, BusSettings(**settings))


@pytest.fixture
def line():
    return Line()


@pytest.fixture
def bus(line):
    bus = bus_on(line)
    start(bus)
    for address in range(1, 7):
        bus.require(address, def_stat(StatusItem.POSITION | StatusItem.AUX))
    return bus


def once(line, change):
    """Mangles the next reply only."""

    def mangle(reply):
        line.mangle = lambda later: [(0.0, later)]
        return change(reply)

    line.mangle = mangle


CASES = {
    "missing": (lambda reply: [], Discarded.MISSING),
    "late": (lambda reply: [(0.03, reply)], Discarded.MISSING),
    "short": (lambda reply: [(0.0, reply[:-2])], Discarded.SHORT),
    "corrupted": (lambda reply: [(0.0, reply[:-1] + bytes((reply[-1] ^ 1,)))], Discarded.CHECKSUM),
    "zeros": (lambda reply: [(0.0, bytes(len(reply)))], Discarded.BLANK),
    "rejected": (lambda reply: [(0.0, bytes((reply[0] | 2, *reply[1:-1], (reply[-1] + 2) % 256)))], Discarded.REJECTED),
}


@pytest.mark.parametrize(("change", "reason"), CASES.values(), ids=CASES)
def test_bad_reply_is_counted_and_the_next_exchange_is_clean(line, bus, change, reason):
    before = bus.errors.copy()
    for number, module in enumerate(line.modules, start=1):
        module.counts = module.target = 1000 * number
    once(line, change)
    assert bus.exchange(2, NOP) is None
    for address in (3, 2, 1):
        assert bus.exchange(address, NOP).position_counts == 1000 * address
    assert bus.errors - before == {f"module 2: {reason.value}": 1}


def test_after_a_stall_of_any_length_no_reply_is_taken_for_another_modules(line, bus):
    """A converter or its computer hands over late, and in order: that lasted longer than the line is flushed."""
    for number, module in enumerate(line.modules, start=1):
        module.counts = module.target = 10 * number
    for stall_ms in range(20, 300, 3):
        end_ns = line.clock.ns + stall_ms * 1_000_000
        line.mangle = lambda reply, end_ns=end_ns: [(max(end_ns - line.clock.ns, 0) * 1e-9, reply)]
        for address in (2, 3, 4, 5, 6, 1) * 2:
            found = bus.attempt(address, NOP)
            assert isinstance(found, Discarded) or found.position_counts == 10 * address, stall_ms
        assert isinstance(found, Reply), stall_ms


@pytest.mark.parametrize(
    ("change", "error"),
    [(CASES["missing"][0], SilentError), (CASES["corrupted"][0], GarbledError), (CASES["zeros"][0], GarbledError)],
)
def test_two_failures_in_a_row_are_an_error(line, bus, change, error):
    line.mangle = change
    assert bus.exchange(1, NOP) is None
    with pytest.raises(error, match="2 failures in a row"):
        bus.exchange(2, NOP)
    line.mangle = lambda reply: [(0.0, reply)]
    assert isinstance(bus.exchange(1, NOP), Reply)


@pytest.mark.parametrize("newest_first", [True, False])
def test_replies_that_come_with_the_next_ones_only_are_told_as_kept_back(line, bus, newest_first):
    kept = []

    def mangle(reply):
        kept.append(reply)
        if len(kept) % 2:
            return []
        return [(0.0, b"".join(kept[:-3:-1] if newest_first else kept[-2:]))]

    line.mangle = mangle
    assert bus.exchange(1, NOP) is None
    with pytest.raises(LateError, match="module 2: 2 failures in a row, the last: two replies at once, of which one"):
        bus.exchange(2, NOP)


def test_failures_of_one_module_between_good_ones_are_an_error(line, bus):
    line.modules[2].address = 0
    assert bus.exchange(3, NOP) is None
    assert bus.exchange(4, NOP)
    with pytest.raises(SilentError, match="module 3"):
        bus.exchange(3, NOP)


@pytest.mark.parametrize("gone", [OSError(5, "unplugged"), TypeError("closed"), ValueError("no port")])
def test_port_that_is_gone_is_silent(line, bus, gone):
    line.gone = gone
    for action in (
        lambda: bus.exchange(1, NOP),
        lambda: bus.attempt(1, NOP),
        lambda: bus.group(stop_motor(StopControl.SMOOTH)),
        lambda: bus.resync(),
    ):
        with pytest.raises((SilentError, StateError), match="gone"):
            action()


def test_echo_is_a_wiring_error(line, bus):
    line.is_echo = True
    assert bus.exchange(1, NOP) is None
    with pytest.raises(WiringError, match="the command itself came back"):
        bus.exchange(1, NOP)


def test_second_master_is_noticed(line, bus):
    frame = stop_motor(StopControl.SMOOTH).frame(2)
    line.put(frame)
    assert bus.exchange(1, NOP)
    line.put(frame)
    with pytest.raises(GarbledError, match="bytes without a request"):
        bus.exchange(1, NOP)
    assert bus.errors["bytes without a request"] == 2 * len(frame)


def test_interrupted_exchange_leaves_nothing_behind(line, bus):
    line.modules[0].counts = line.modules[0].target = 111
    ordinary = line.read

    def interrupted(size=1):
        line.read = ordinary
        raise KeyboardInterrupt

    line.read = interrupted
    with pytest.raises(KeyboardInterrupt):
        bus.exchange(1, NOP)
    assert bus.exchange(2, NOP).position_counts == 0


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


def test_missing_modules_are_a_wiring_error():
    line = Line([])
    with pytest.raises(WiringError, match="no module takes an address at any of 19200, 57600"):
        start(bus_on(line))


def test_somebody_at_another_rate_who_does_not_obey_the_reset():
    class Stubborn(Module):
        def reset(self):
            pass

    line = Line([Stubborn(address=1, baud=57_600)])
    with pytest.raises(WiringError, match="switch them off and on"):
        start(bus_on(line))


def test_modules_that_do_not_follow_the_change_of_rate():
    class Slow(Module):
        def obey(self, code, data):
            return None if code == 0xA else super().obey(code, data)

    line = Line([Slow(), Module(), Slow()])
    with pytest.raises(SilentError, match="no answer from module 1, 3"):
        start(bus_on(line))


def test_echo_at_start_is_a_wiring_error():
    line = Line([])
    line.is_echo = True
    with pytest.raises(WiringError, match="comes back"):
        start(bus_on(line))
    with pytest.raises(WiringError, match="comes back"):
        attach(bus_on(line), 6)


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
