"""Fuzz target: the NMC driver and the arm on it, on a line whose every read delivers a piece of the input."""

from contextlib import suppress

from benchmarks.fuzzing import require
from palpate.drivers.errors import DriverError
from palpate.drivers.nmc.frames import StatusItem
from palpate.drivers.nmc.replies import Reply, decode_reply, reply_size_bytes
from palpate.drivers.zebra_zero.codec import HOME_RAD
from palpate.drivers.zebra_zero.device import ZebraZero
from palpate.drivers.zebra_zero.settings import ZebraZeroSettings

MAX_READS = 3000
CYCLES = 8


class NonsenseLine:
    """Answers every read with the next piece of the input, whose length the input says as well."""

    def __init__(self, data):
        self.baudrate, self.timeout = 9600, None
        self.data, self.ns, self.reads = data, 0, 0

    def clock_ns(self):
        return self.ns

    def sleep_s(self, duration_s):
        self.ns += round(duration_s * 1e9)

    @property
    def in_waiting(self):
        return self.data[0] & 7 if self.data and self.data[0] >= 0xF8 else 0

    def read(self, size=1, /):
        self.reads += 1
        if self.reads > MAX_READS:
            raise OSError("end of the script")
        if not self.data or self.data[0] == 0:
            self.data = self.data[1:]
            self.ns += round((self.timeout or 0.0) * 1e9)
            return b""
        if self.data[0] == 1:
            self.data = self.data[1:]
            raise OSError("unplugged")
        length = min(size, self.data[0])
        piece, self.data = self.data[1 : 1 + length], self.data[1 + length :]
        if self.data[:1] == b"\xf7" and len(piece) == size > 1:
            # Without help the search would hardly ever find a right sum.
            piece, self.data = piece[:-1] + bytes((sum(piece[:-1]) & 0xFF,)), self.data[1:]
        return piece

    def write(self, data, /):
        return len(data)

    def reset_input_buffer(self):
        pass


def once(data):
    """All targets on one input; raises what the driver should not have raised."""
    mask, raw = StatusItem(data[0] if data else 0), data[1:]
    if isinstance(decode_reply(raw, mask), Reply):
        size = reply_size_bytes(mask)
        require(sum(raw[: size - 1]) & 0xFF == raw[size - 1], "an accepted reply has the right sum")
        require(any(raw[:size]), "zeros only are no reply")
    line = NonsenseLine(raw)
    arm = ZebraZero(line, line.clock_ns, line.sleep_s, ZebraZeroSettings(control_rate_Hz=140), at_home=True)
    try:
        arm.open()
        arm.enable()
        for step in range(CYCLES):
            line.sleep_s(1 / 46)
            measured = arm.cycle(tuple([q + 0.001 * step for q in HOME_RAD]))
            require(arm.settings.limits.outside(measured.position_rad, 0.02) is None, "a pose within the limits")
    except DriverError:
        arm.stop()
        if arm.fault is not None:
            with suppress(DriverError):
                arm.acknowledge()
    arm.close()
