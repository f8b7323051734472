"""An emulated Net F/T box at the other end of a network without delay, in virtual time."""

from palpate.drivers.ati import parse_box
from palpate.drivers.errors import WiringError


class VirtualBox:
    """The box, and the wire that an adapter opens."""

    def __init__(self, clock, box):
        self.clock, self.box = clock, box
        self.is_open, self.is_plugged, self._arrived = False, True, list[bytes]()
        clock.devices.append(self)

    def open(self, table):
        if not self.is_plugged:
            raise WiringError("box", "the network is unreachable", "plug it in")
        box = parse_box(self.box.page())
        self.is_open = True
        return self, box

    def close(self):
        self.is_open = False

    def _require_cable(self):
        if not self.is_plugged:
            raise OSError("the network is unreachable")

    def send(self, datagram):
        self._require_cable()
        self.box.receive(datagram, self.clock.now_ns())

    def receive(self):
        self._require_cable()
        arrived, self._arrived = self._arrived, []
        return arrived

    def next_event_ns(self):
        return self.box.next_event_ns()

    def step(self, now_ns):
        self._arrived += self.box.step(now_ns)
