"""Fuzz target: what CiA 402 drives say. No frame may raise, grow memory, or outlast an acknowledgement."""

from benchmarks.fuzzing import require
from palpate.drivers.device import ArmState
from palpate.drivers.errors import DriverError
from tests.support.cia402_bench import Bench

_IDENTIFIERS = (0x180, 0x700, 0x080, 0x580)
"""Process data, heartbeat, EMCY, SDO answer."""
_LENGTHS = (7, 1, 8, 8)
_SYNC = 0x80
_KEPT = 65


def frames_in(data):
    """Whether a cycle ends after the frame, whether the drives are mute in it, identifier and payload."""
    frames, at = [], 0
    while at + 2 <= len(data):
        kind = data[at] & 0x03
        # Mostly the length that fits: otherwise nearly everything would be refused for that alone.
        size = _LENGTHS[kind] if data[at] & 0x04 else data[at + 1] >> 4
        identifier = _IDENTIFIERS[kind] + 1 + (data[at + 1] & 0x0F) % 6
        frames.append((bool(data[at] & 0x08), bool(data[at] & 0x10), identifier, data[at + 2 : at + 2 + min(size, 8)]))
        at += 2 + min(size, 8)
    return frames


def once(data):
    """One enabled arm and what it hears; returns the state that it ended in, before the acknowledgement."""
    bench = Bench().enabled()
    network, arm = bench.network, bench.arm
    send, mute = network.send_message, False
    heard = []

    def send_among_others(can_id, payload, remote=False):
        if can_id != _SYNC:
            send(can_id, payload, remote)
            return
        for identifier, words in heard:
            for callback in network.subscribers.get(identifier, []):
                callback(identifier, bytearray(words), 0.0)
        heard.clear()
        if not mute:
            send(can_id, payload, remote)

    network.send_message = send_among_others
    for ends, quiet, identifier, payload in frames_in(data):
        heard.append((identifier, payload))
        mute = quiet
        if ends:
            try:
                measured = bench.cycle()
                require(all(-2.0 < q < 2.0 for q in measured.position_rad), "no pose far beyond the limits passes")
            except DriverError:
                require(arm.state is ArmState.FAULTED, "what ends a cycle latches")
    mute = False
    boxes = arm._exchange._mailbox.look()  # noqa: SLF001
    require(all(len(box.active) <= _KEPT for box in boxes), "bounded memory")
    ended = arm.state
    heard.clear()
    if ended is ArmState.FAULTED:
        network.wait_until(network.now_ns + 60_000_000)
        arm.acknowledge()
        require(arm.state is ArmState.CONFIGURED, "the bus is as before after an acknowledgement")
    arm.close()
    return ended.value
