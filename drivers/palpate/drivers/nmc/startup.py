"""Start up the bus: reset and address the modules, or take over running modules, and set the baud rate.

FACT (libnmc): send 20 zeros, HARD_RESET to all twice, and SET_ADDR to address 0 with 1, 2, ..., until none answers.
Each reply enables the next module in the chain. Modules may still use the baud rate of an earlier run, so the reset is
sent at every known rate.
"""

from dataclasses import dataclass
from typing import Final

from palpate.drivers.errors import SilentError, WiringError
from palpate.drivers.nmc.commands import HARD_RESET, read_stat, set_addr, set_baud
from palpate.drivers.nmc.device import DEVICE, NmcBus
from palpate.drivers.nmc.frames import EVERYBODY, StatusItem
from palpate.drivers.nmc.replies import Discarded, ModuleIdentity, Reply
from palpate.drivers.nmc.settings import BAUD_DIVISORS, MAX_MODULES, POWER_UP_BAUD

_WAKE: Final = bytes(20)
_RESETS: Final = 2
_TRIES: Final = 3
_UNADDRESSED: Final = 0
_BAUD_SETTLE_S: Final = 0.01
"""Wait after SET_BAUD, for the ports on the modules and the host to settle. INFERENCE."""


@dataclass(frozen=True, slots=True)
class Module:
    """A module that has answered."""

    address: int
    identity: ModuleIdentity


def start(bus: NmcBus) -> tuple[Module, ...]:
    """Reset all modules, assign addresses from 1, and set the baud rate; return the modules in address order.

    Every motor is switched off, and every position counter is set to zero.

    Raises:
        WiringError: No module answers, one answers only at an unexpected rate, or the line echoes.
        SilentError: A module stopped answering during start-up, or the port is gone.
        GarbledError: All replies are invalid.
    """
    for baud in _other_rates(POWER_UP_BAUD):
        _reset_all(bus, baud)
    bus.forget()
    addresses = _address_chain(bus)
    if not addresses:
        problem = f"no module takes an address at any of {', '.join(map(str, BAUD_DIVISORS))} baud"
        remedy = "check the port's name, both pairs of wires, and the supply of the modules: switch them off and on"
        raise WiringError(DEVICE, problem, remedy)
    change_baud(bus, addresses)
    return _identify(bus, addresses)


def attach(bus: NmcBus, count: int) -> tuple[Module, ...] | None:
    """Take over modules that still have addresses from an earlier run, without a reset or a change to the motors.

    Returns None if module 1 does not answer at any known rate; :func:`start` is then necessary.

    Raises:
        SilentError: Module 1 answers but others do not, for example because they were reset; or the port is gone.
        GarbledError: All replies of a module are invalid.
        WiringError: The line echoes.
    """
    for baud in reversed(_other_rates(bus.settings.baud)):
        bus.set_line(baud)
        bus.forget()
        if isinstance(_ask(bus, 1, StatusItem.IDENTITY, tries=2), Reply):
            addresses = range(1, count + 1)
            bus.forgive()
            modules = _identify(bus, addresses)
            if baud != bus.settings.baud:
                change_baud(bus, addresses)
            return modules
    return None


def change_baud(bus: NmcBus, addresses: range) -> None:
    """Switch the modules to the baud rate in the settings, and check that all have followed."""
    baud = bus.settings.baud
    if baud == bus.line.baud:
        return
    bus.send_raw(set_baud(BAUD_DIVISORS[baud]).frame(EVERYBODY))
    bus.wait_s(_BAUD_SETTLE_S)
    bus.set_line(baud)
    lost = [address for address in addresses if not _answers(bus, address)]
    if not lost:
        bus.forgive()
        return
    names = ", ".join(map(str, lost))
    problem = f"after the change to {baud} baud no answer from module {names}"
    raise SilentError(DEVICE, problem, "start again, with a lower baud rate if this repeats")


def _other_rates(last: int) -> tuple[int, ...]:
    return (*(baud for baud in BAUD_DIVISORS if baud != last), last)


def _reset_all(bus: NmcBus, baud: int) -> None:
    bus.set_line(baud)
    bus.send_raw(_WAKE)
    for _ in range(_RESETS):
        bus.send_raw(HARD_RESET.frame(EVERYBODY))
        bus.wait_s(bus.settings.reset_wait_s)


def _address_chain(bus: NmcBus) -> range:
    found = 0
    for address in range(1, MAX_MODULES + 1):
        command = set_addr(address)
        result: Reply | Discarded = Discarded.MISSING
        for _ in range(_TRIES):
            result = bus.attempt(_UNADDRESSED, command)
            if result is Discarded.ECHO:
                raise _echo()
            # If only the reply was lost, the same command would also address the next module.
            if isinstance(result, Reply) or _answers(bus, address):
                found = address
                break
            if result is Discarded.MISSING:
                break
        if found != address:
            break
    # All replies look alike: a late one was mistaken for that of the next module, which may not exist.
    while found and not _answers(bus, found):
        found -= 1
    bus.forgive()
    return range(1, found + 1)


def _answers(bus: NmcBus, address: int) -> bool:
    # READ_STAT, not NOP: the mask of a module that was taken over is unknown.
    return any(isinstance(bus.attempt(address, read_stat(StatusItem(0))), Reply) for _ in range(_TRIES))


def _ask(bus: NmcBus, address: int, items: StatusItem, tries: int) -> Reply | Discarded:
    result: Reply | Discarded = Discarded.MISSING
    for _ in range(tries):
        result = bus.attempt(address, read_stat(items))
        if result is Discarded.ECHO:
            raise _echo()
        if isinstance(result, Reply):
            break
    return result


def _identify(bus: NmcBus, addresses: range) -> tuple[Module, ...]:
    modules = []
    for address in addresses:
        identity = bus.require(address, read_stat(StatusItem.IDENTITY)).identity
        if identity is not None:
            modules.append(Module(address, identity))
    return tuple(modules)


def _echo() -> WiringError:
    remedy = "connect both pairs of the full-duplex bus, without loop or local echo"
    return WiringError(DEVICE, "what is sent comes back unchanged", remedy)
