"""A bus without threads and without real time: what the host sends reaches emulated drives at once, and back."""

from types import SimpleNamespace

from palpate.drivers.cia402 import ArmSettings, CanopenLink, Cia402Arm, JointDrive
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.lines.can_bus import BusFrame
from tests.support.ideal_motors import IdealPlant

SCALE = 10_000.0
NODES = (1, 2, 3, 4, 5, 6)
PERIOD_NS = 1_000_000_000 // 140


class FakeNetwork:
    """Looks like ``canopen.Network`` as far as the driver uses it."""

    def __init__(self, nodes):
        self.nodes = nodes
        self.subscribers = {}
        self.notifier = SimpleNamespace(exception=None, stopped=False)
        self.now_ns = 1_000_000
        self.sent = []
        self.broken = None

    def subscribe(self, can_id, callback):
        self.subscribers.setdefault(can_id, []).append(callback)

    def unsubscribe(self, can_id):
        del self.subscribers[can_id]

    def send_message(self, can_id, data, remote=False):
        if self.broken is not None:
            raise self.broken
        self.sent.append((can_id, bytes(data)))
        for node in self.nodes:
            self.deliver(node.feed(can_id, bytes(data), self.now_ns))

    def deliver(self, frames):
        for frame in frames:
            for callback in self.subscribers.get(frame.arbitration_id, []):
                callback(frame.arbitration_id, bytearray(frame.data), 0.0)

    def clock(self):
        self.now_ns += 1_000
        return self.now_ns

    def sleep(self, duration_s):
        self.wait_until(self.now_ns + round(duration_s * 1e9))

    def wait_until(self, end_ns):
        while self.now_ns < end_ns:
            self.now_ns = min(end_ns, self.now_ns + 500_000)
            for node in self.nodes:
                self.deliver(node.advance(self.now_ns))

    def disconnect(self):
        self.notifier.stopped = True


def mute(drive):
    """It hears and obeys, and is heard no more."""
    drive.outgoing = lambda frames: []


def on_answers(drive, change, times=1 << 30):
    """Have the next so many of its process data changed."""
    left = [times]

    def outgoing(frames):
        out = []
        for frame in frames:
            is_answer = frame.arbitration_id == 0x180 + drive.node and left[0] > 0
            left[0] -= is_answer
            out += change(frame) if is_answer else [frame]
        return out

    drive.outgoing = outgoing


def lost(frame):
    return []


def flipped(bit):
    """A bit of the statusword the other way round."""

    def change(frame):
        word = int.from_bytes(frame.data[:2], "little") ^ 1 << bit
        return [BusFrame(frame.arbitration_id, word.to_bytes(2, "little") + frame.data[2:])]

    return change


class Bench:
    """Six emulated drives and the arm that drives them."""

    def __init__(self, **settings):
        self.plant = IdealPlant()
        self.drives = [CanopenDrive(node, self.plant, axis) for axis, node in enumerate(NODES)]
        self.network = FakeNetwork(self.drives)
        self.network.sleep(0.05)
        self.settings = ArmSettings(joints=joints(), control_rate_Hz=140, sdo_timeout_s=0.01, **settings)
        self.arm = Cia402Arm(
            CanopenLink(self.network), self.settings, now_ns=self.network.clock, sleep=self.network.sleep
        )
        # Waiting is what lets this bus go on; the lock is re-entrant, so frames may come in meanwhile.
        self.arm._exchange._mailbox._all_here.wait = self.network.sleep

    def enabled(self):
        self.arm.open()
        self.arm.enable()
        return self

    def cycle(self, setpoint=None, times=1):
        requested = (setpoint,) * 6 if isinstance(setpoint, float) else setpoint
        for _ in range(times):
            # Time goes on to the next tick, not by a period after however long the last one took.
            self.network.wait_until(-(-self.network.now_ns // PERIOD_NS) * PERIOD_NS)
            measured = self.arm.cycle(requested)
        return measured

    def words(self):
        """Controlwords sent to the first drive, in order, without repetitions."""
        words = [int.from_bytes(data[:2], "little") for can_id, data in self.network.sent if can_id == 0x201]
        return [word for i, word in enumerate(words) if i == 0 or words[i - 1] != word]


def joints(scale=SCALE):
    return tuple(
        JointDrive(node=node, counts_per_rad=scale, lower_rad=-1.0, upper_rad=1.0, velocity_rad_per_s=1.0)
        for node in NODES
    )
