"""Serial line for an NMC chain, which distributes commands to the modules and returns their replies."""

from collections.abc import Sequence
from functools import reduce
from itertools import zip_longest

from palpate.simulation.emulators.motors import AXES, JointPlant
from palpate.simulation.emulators.nmc.frames import TICK_NS, CommandCode, Frame, FrameParser
from palpate.simulation.emulators.nmc.module import NmcModule

_IDLE_LINE = 0xFF


class NmcChain:
    """A daisy chain of servo modules, simulated from power-up on. It is a `SerialEmulator` without a wall clock.

    A module receives nothing until its predecessor has an address (FACT, libnmc's start-up). It keeps receiving even
    if its predecessor is later reset (assumed). Simultaneous replies collide and are combined (assumed: wired AND).
    Axis i of the plant belongs to the i-th module in the chain.
    """

    def __init__(self, plant: JointPlant, modules: int = AXES) -> None:
        self.plant = plant
        self.modules: Sequence[NmcModule] = tuple(NmcModule(axis, plant) for axis in range(modules))
        self._receiving = [index == 0 for index in range(modules)]
        self._parser = FrameParser()
        self._next_tick_ns: int | None = None

    @property
    def baud(self) -> int:
        """Line rate used by most listening modules. Modules with other rates receive nothing."""
        rates = [module.baud for module, receiving in zip(self.modules, self._receiving, strict=True) if receiving]
        return max(rates, key=rates.count)

    def feed(self, data: bytes, now_ns: int) -> bytes:
        """Receive bytes that arrived at `baud` until `now_ns`, and return the replies."""
        self.advance(now_ns)
        replies = b""
        for byte in data:
            frame = self._parser.push(byte)
            if frame is not None:
                replies += self._dispatch(frame)
        return replies

    def advance(self, now_ns: int) -> bytes:
        """Run the servo ticks due by `now_ns`, ignoring decreasing times. The result is always empty."""
        if self._next_tick_ns is None:
            self._next_tick_ns = now_ns + TICK_NS
        while self._next_tick_ns <= now_ns:
            for module in self.modules:
                module.tick()
            self._next_tick_ns += TICK_NS
        return b""

    def set_power(self, *, powered: bool) -> None:
        """Switch the motor supply of all modules on or off."""
        for module in self.modules:
            module.servo.set_power(powered=powered)

    def _dispatch(self, frame: Frame) -> bytes:
        baud = self.baud
        # The listening modules are determined before any of them acts: SET_ADDR opens the next module for later frames.
        listeners = [
            (index, module)
            for index, module in enumerate(self.modules)
            if self._receiving[index] and module.baud == baud and frame.address in (module.address, module.group)
        ]
        replies = []
        for index, module in listeners:
            answers = module.address == frame.address or module.leader
            reply = module.execute(frame)
            if answers and reply:
                replies.append(reply)
            if frame.intact and frame.command == CommandCode.SET_ADDR and index + 1 < len(self.modules):
                self._receiving[index + 1] = True
        if frame.intact and frame.command == CommandCode.HARD_RESET:
            # Only the first module listens when the whole chain is in the state after power-up.
            receivers = [module for module, receiving in zip(self.modules, self._receiving, strict=True) if receiving]
            if all(module.address == 0 for module in receivers):
                self._receiving = [index == 0 for index in range(len(self.modules))]
        # Replies collide: the line is low where any of them is.
        return bytes(reduce(int.__and__, column) for column in zip_longest(*replies, fillvalue=_IDLE_LINE))
