"""What the benches of arms on an emulated bus have in common."""

from abc import ABC, abstractmethod

from tests.virtual_lines import VirtualDesk

DIVIDER = 2
LONG_NS = 3_600 * 10**9
"""A set-point time-out that no clause waits for."""


def loads(wrench):
    """The knobs that load a sensor whose emulator shows this wrench, N and Nm, (6,)."""

    def change(first):
        def load(x, y, z):
            wrench[first : first + 3] = (x, y, z)

        return load

    return {"push_N": change(0), "twist_Nm": change(3)}


class BusBench(ABC):
    """An adapter and the devices that it talks to; whoever makes it plugs them in."""

    def __init__(self):
        self.desk = VirtualDesk()
        self.clock = self.desk.clock

    @abstractmethod
    def fail(self):
        """A device fails; returns when the adapter has noticed."""

    def advance(self, ticks):
        # The arm's own ticks, one bus cycle each.
        self.clock.sleep(ticks * DIVIDER / 140)

    def knobs(self):
        """Of encoder and arm alike."""
        return {
            "device": self.arm,
            "clock": self.clock,
            "advance": self.advance,
            "tolerance_rad": 2e-4,
            "provoke_fault": self.fail,
            "disconnect": self.cable.cut,
            "reconnect": self.cable.join,
            "dispose": self.desk.close,
            "runs_by_itself": True,
        }
