"""The conversation: from the first ping to the first reading, and its end."""

from typing import Any

import pytest

from palpate.drivers.can.link import CanFrame
from palpate.drivers.errors import (
    DeviceFaultError,
    DriverError,
    GarbledError,
    SettingError,
    SilentError,
    StateError,
    WiringError,
)
from palpate.drivers.jr3 import CanTransport, Jr3, Jr3Settings, shut_down, start_up
from palpate.drivers.jr3.messages import FullScales
from palpate.drivers.jr3.phases import Jr3Phase
from tests.unit.drivers.jr3.board import FORCES_N, MOMENTS_DNM, Bench, FakeCanLink, forces, moments


def test_the_order_of_requests() -> None:
    bench = Bench().streaming()
    assert bench.link.asked == ["state", "force scales", "moment scales", "stop", "start"]
    assert bench.device.identity.full_scales == FullScales(FORCES_N, MOMENTS_DNM)


def test_only_one_request_is_in_flight() -> None:
    bench = Bench()
    bench.link.mute = {"force scales"}
    bench.device.open()
    bench.polls(100)
    assert bench.link.asked == ["state", "force scales"]


def test_a_late_acknowledgement_counts_once() -> None:
    bench = Bench()
    bench.link.mute = {"state"}
    bench.device.open()
    bench.polls(260)
    assert bench.link.asked == ["state", "state"]
    bench.link.inbox += bench.link.ack("state") * 2
    bench.link.mute = set()
    bench.polls(9)
    assert bench.link.asked == ["state", "state", "force scales", "moment scales", "stop", "start"]
    statistics = bench.device.statistics()
    assert (statistics.timeouts, statistics.strays) == (1, 1)


def test_a_late_answer_for_forces_is_not_taken_for_moments() -> None:
    bench = Bench()
    bench.link.mute = {"force scales"}
    bench.device.open()
    while len(bench.link.asked) < 3:
        bench.poll()
    assert bench.link.asked == ["state", "force scales", "state"]
    # Both answers come at once: the late long one and the short one that was asked for.
    bench.link.inbox = bench.link.ack("force scales") + bench.link.ack("state")
    bench.link.mute = set()
    bench.polls(9)
    assert bench.device.identity.full_scales == FullScales(FORCES_N, MOMENTS_DNM)


def test_nobody_there() -> None:
    bench = Bench()
    bench.link.mute = {"state"}
    with pytest.raises(WiringError, match="nobody answers"):
        start_up(bench.device, bench.clock_ns, bench.sleep)
    assert bench.link.asked == ["state"] * 16
    assert bench.device.phase is Jr3Phase.FAULTED


@pytest.mark.parametrize(
    ("board", "error", "told"),
    [
        (
            {"answer": lambda _: [CanFrame(0x101, b"\x07")]},
            GarbledError,
            "nothing but 16 frames without sense",
        ),
        ({"state": 1}, DeviceFaultError, "not initialised"),
        (
            {"answer": lambda name: [CanFrame(0x101, bytes(7))] if name == "force scales" else None},
            DeviceFaultError,
            "full scales",
        ),
        ({}, SilentError, "no new reading"),
    ],
    ids=["garbage", "no sensor", "full scales of zero", "no stream"],
)
def test_a_board_with_which_nothing_can_begin_is_told(
    board: dict[str, Any], error: type[DriverError], told: str
) -> None:
    bench = Bench()
    vars(bench.link).update(board)
    with pytest.raises(error, match=told):
        start_up(bench.device, bench.clock_ns, bench.sleep)


@pytest.mark.parametrize("request_name", ["stop", "start", "moment scales"])
def test_a_board_that_falls_silent_while_it_is_set_up(request_name: str) -> None:
    bench = Bench()
    bench.link.mute = {request_name}
    with pytest.raises(SilentError, match="no answer"):
        start_up(bench.device, bench.clock_ns, bench.sleep)
    assert bench.link.asked.count(request_name) in (3, 4)


def test_full_scales_of_a_sensor_that_is_not_initialised_are_ignored() -> None:
    bench = Bench()
    stale = CanFrame(0x101, b"\x01" + b"\xff" * 6)
    answers = {"force scales": [stale]}
    bench.link.answer = lambda name: answers.pop(name, None)
    bench.device.open()
    bench.polls(280)
    assert bench.device.identity.full_scales == FullScales(FORCES_N, MOMENTS_DNM)


def test_a_board_that_boots_meanwhile_is_waited_for() -> None:
    bench = Bench()
    bench.link.state = 1
    bench.device.open()
    bench.polls(1000)
    assert bench.device.phase is Jr3Phase.PINGING
    bench.link.state = 0
    bench.polls(260)
    assert bench.device.phase is Jr3Phase.AWAITING
    assert bench.device.statistics().timeouts == 0


def test_blocking_helpers() -> None:
    bench = Bench()
    sleep = bench.sleep

    def sleep_and_stream(seconds: float) -> None:
        sleep(seconds)
        if "start" in bench.link.asked:
            bench.counter += 16
            bench.link.inbox += [forces(bench.counter), moments(bench.counter)]

    start_up(bench.device, bench.clock_ns, sleep_and_stream)
    for _ in range(50):
        sleep_and_stream(0.002)
        bench.device.poll(bench.now_ns)
    shut_down(bench.device, bench.clock_ns, sleep_and_stream)
    shut_down(bench.device, bench.clock_ns, sleep_and_stream)
    assert bench.device.phase is Jr3Phase.CLOSED


def test_a_wait_has_an_end() -> None:
    bench = Bench()
    bench.link.mute = {"state"}
    with pytest.raises(SilentError, match="still asking for the state"):
        start_up(bench.device, bench.clock_ns, bench.sleep, timeout_s=1.0)


def test_leaving_a_board_that_does_not_answer() -> None:
    bench = Bench().streaming()
    bench.link.mute = {"stop"}
    shut_down(bench.device, bench.clock_ns, bench.sleep)
    assert bench.device.phase is Jr3Phase.CLOSED


def test_wishes_out_of_order_are_refused() -> None:
    bench = Bench()
    for wish in (bench.device.stop, lambda: bench.device.identity):
        with pytest.raises(StateError):
            wish()
    bench.streaming()
    with pytest.raises(StateError):
        bench.device.open()


def test_more_readings_than_the_wire_carries() -> None:
    with pytest.raises(SettingError, match="or more on this wire"):
        Jr3(CanTransport(FakeCanLink()), Jr3Settings(period_us=500))
