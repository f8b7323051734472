"""The conversation with a JR3 board: from the first ping to the first reading, restarts, silence, and its end."""

import re

import pytest

from palpate.drivers.can import CanFrame
from palpate.drivers.errors import DeviceFaultError, SilentError, StateError, WiringError
from palpate.drivers.jr3 import shut_down, start_up
from palpate.drivers.jr3.messages import FullScales
from palpate.drivers.jr3.phases import Jr3Phase
from tests.unit.drivers.jr3_board import FORCES_N, MOMENTS_DNM, Bench, forces, moments

BOOTUP = CanFrame(0x701)


def test_late_acknowledgement_counts_once():
    bench = Bench()
    bench.link.mute = {"state"}
    bench.device.open()
    bench.polls(260)
    assert bench.link.requested == ["state", "state"]
    bench.link.inbox += bench.link.ack("state") * 2
    bench.link.mute = set()
    bench.polls(9)
    assert bench.link.requested == ["state", "state", "force scales", "moment scales", "stop", "start"]


def test_late_answer_for_forces_is_not_taken_for_moments():
    bench = Bench()
    bench.link.mute = {"force scales"}
    bench.device.open()
    while len(bench.link.requested) < 3:
        bench.poll()
    assert bench.link.requested == ["state", "force scales", "state"]
    # Both answers come at once: the late long one and the short one that was asked for.
    bench.link.inbox = bench.link.ack("force scales") + bench.link.ack("state")
    bench.link.mute = set()
    bench.polls(9)
    assert bench.device.full_scales == FullScales(FORCES_N, MOMENTS_DNM)


@pytest.mark.parametrize(
    ("board", "error", "message"),
    [
        ({"mute": {"state"}}, WiringError, r"no answer \("),
        ({"answer": lambda _: [CanFrame(0x101, b"\x07")]}, WiringError, r"no answer \(frames without sense \(16\)\)"),
        ({"state": 1}, DeviceFaultError, "not initialised"),
        (
            {"answer": lambda name: [CanFrame(0x101, bytes(7))] if name == "force scales" else None},
            DeviceFaultError,
            "full scales",
        ),
        ({}, SilentError, "nothing new yet"),
    ],
    ids=["no board", "garbage", "no sensor", "full scales of zero", "no stream"],
)
def test_board_with_which_nothing_can_begin_is_named(board, error, message):
    bench = Bench()
    vars(bench.link).update(board)
    with pytest.raises(error, match=message):
        start_up(bench.device, bench.clock_ns, bench.sleep)


@pytest.mark.parametrize("request_name", ["stop", "start", "moment scales"])
def test_board_that_falls_silent_while_it_is_set_up_is_asked_again(request_name):
    bench = Bench()
    bench.link.mute = {request_name}
    with pytest.raises(SilentError, match="no answer"):
        start_up(bench.device, bench.clock_ns, bench.sleep)
    assert bench.link.requested.count(request_name) in (3, 4)


def test_full_scales_of_a_sensor_that_is_not_initialised_are_ignored():
    bench = Bench()
    stale = CanFrame(0x101, b"\x01" + b"\xff" * 6)
    answers = {"force scales": [stale]}
    bench.link.answer = lambda name: answers.pop(name, None)
    bench.device.open()
    bench.polls(280)
    assert bench.device.full_scales == FullScales(FORCES_N, MOMENTS_DNM)


def test_board_that_boots_meanwhile_is_waited_for():
    bench = Bench()
    bench.link.state = 1
    bench.device.open()
    bench.polls(1000)
    assert bench.device.phase is Jr3Phase.PINGING
    bench.link.state = 0
    bench.polls(260)
    assert bench.device.phase is Jr3Phase.AWAITING


def test_helpers_wait_for_the_stream_and_for_its_end():
    bench = Bench()
    sleep = bench.sleep

    def sleep_and_stream(seconds):
        sleep(seconds)
        if "start" in bench.link.requested:
            bench.counter += 16
            bench.link.inbox += [forces(bench.counter), moments(bench.counter)]

    start_up(bench.device, bench.clock_ns, sleep_and_stream)
    for _ in range(50):
        sleep_and_stream(0.002)
        bench.device.poll(bench.now_ns)
    shut_down(bench.device, bench.clock_ns, sleep_and_stream)
    shut_down(bench.device, bench.clock_ns, sleep_and_stream)
    assert bench.device.phase is Jr3Phase.CLOSED


def test_wait_has_an_end():
    bench = Bench()
    bench.link.mute = {"state"}
    with pytest.raises(SilentError, match="still asking for the state"):
        start_up(bench.device, bench.clock_ns, bench.sleep, timeout_s=1.0)


def test_board_that_does_not_answer_can_be_left():
    bench = Bench().streaming()
    bench.link.mute = {"stop"}
    shut_down(bench.device, bench.clock_ns, bench.sleep)
    assert bench.device.phase is Jr3Phase.CLOSED


def test_requests_out_of_order_are_refused():
    bench = Bench()
    for wish in (bench.device.stop, lambda: bench.device.full_scales):
        with pytest.raises(StateError):
            wish()
    bench.streaming()
    with pytest.raises(StateError):
        bench.device.open()


def test_bootup_in_mid_run_starts_again_and_marks_samples():
    bench = Bench().streaming()
    last = bench.device.latest
    bench.link.requested.clear()
    bench.link.inbox.append(BOOTUP)
    bench.poll()
    assert bench.device.phase is Jr3Phase.PINGING
    bench.polls(8)
    bench.counter = 0
    (sample,) = bench.read()
    assert bench.link.requested == ["state", "force scales", "moment scales", "stop", "start"]
    assert bench.device.after_boot
    assert sample.settling
    assert sample.sequence == last.sequence + 1
    bench.device.acknowledge()
    assert not bench.device.after_boot
    assert bench.device.diagnostics()["restarts"] == "1"


def test_restarts_with_readings_between_are_no_fault():
    bench = Bench().streaming()
    for _ in range(6):
        bench.link.inbox.append(BOOTUP)
        bench.polls(8)
        assert len(bench.read()) == 1
    bench.device.check()


@pytest.mark.parametrize(
    ("counts", "saturated"), [(16384, False), (26214, False), (26215, True), (-32752, True), (32767, True)]
)
def test_saturation(counts, saturated):
    (sample,) = Bench().streaming().read(z=counts)
    assert sample.saturated is saturated


def test_silence_ends_with_a_reading():
    bench = Bench().streaming()
    bench.polls(200)
    bench.device.check()
    bench.polls(2)
    assert bench.device.phase is Jr3Phase.SILENT
    with pytest.raises(SilentError, match="nothing new for 202 ms"):
        bench.device.check()
    assert len(bench.read()) == 1
    bench.device.check()
    assert bench.device.phase is Jr3Phase.STREAMING


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("silence", "; check power"),
        ("the same again", r", but repeated readings \(\d+\); .* plugged into its board"),
        ("halves", r", but halves of readings without the other half \(\d+\);"),
        ("other lengths", r", but frames without sense \(\d+\);"),
    ],
)
def test_silence_tells_from_the_first_moment_what_came_instead(what, message):
    bench = Bench().streaming()
    halves = {
        "silence": lambda n: [],
        "the same again": lambda n: [forces(bench.counter), moments(bench.counter)],
        "halves": lambda n: [forces(bench.counter + n)],
        "other lengths": lambda n: [CanFrame(0x601, bytes(5))],
    }[what]
    for n in range(1, 22):
        bench.link.inbox += halves(n)
        bench.poll(10.0)
        if n == 6:
            assert re.search(f"nothing new for 60 ms{message}", str(bench.device.silence(bench.now_ns)))
    with pytest.raises(SilentError, match=f"nothing new for 210 ms{message}"):
        bench.device.check()


def test_cable_that_is_plugged_in_again_needs_an_open():
    bench = Bench().streaming()
    bench.link.broken = True
    assert bench.poll() == []
    assert bench.device.phase is Jr3Phase.FAULTED
    with pytest.raises(SilentError, match="cable pulled"):
        bench.device.check()
    bench.link.broken = False
    bench.device.open()
    bench.polls(8)
    bench.read()
    bench.device.check()
