"""Configure a drive via SDO: identity, process data, and the conditions under which it stops on its own.

FACT (``canopen`` 2.4.1): a PDO can be configured only while its identifier is marked invalid (bit 31). Standard
knowledge, CiA 301 and CiA 402-2: the objects below, their sizes and the option codes. The driver does not rely on a
manufacturer's default mapping.
"""

from typing import Final

from palpate.drivers.cia402.codec import CSP, RPDO1, TPDO1
from palpate.drivers.cia402.objects import Objects
from palpate.drivers.cia402.settings import HEARTBEAT_MS, ArmSettings, JointDrive
from palpate.drivers.errors import DeviceFaultError, SilentError, WiringError

_RPDO1_SETTINGS: Final = 0x1400
_RPDO1_MAPPING: Final = 0x1600
_TPDO1_SETTINGS: Final = 0x1800
_TPDO1_MAPPING: Final = 0x1A00
_PREDEFINED_PDOS: Final = 4
_INVALID: Final = 1 << 31
_EVERY_SYNC: Final = 1

_CONTROLWORD: Final = 0x6040_00_10
_STATUSWORD: Final = 0x6041_00_10
_POSITION: Final = 0x6064_00_20
_MODE: Final = 0x6061_00_08
_TARGET: Final = 0x607A_00_20

_DRIVE_PROFILE: Final = 402
_STAY_IN_QUICK_STOP: Final = 6
_QUICK_STOP_WHEN_HOST_IS_LOST: Final = 3
_TENTH_OF_MS: Final = -4
"""Power of ten that gives the unit of the period in seconds: 0.1 ms."""


def identify(objects: Objects) -> str:
    """Return the name and serial number of a drive."""
    try:
        profile = objects.read(0x1000)
    except SilentError as error:
        raise WiringError(objects.name, error.problem, error.remedy) from error
    kind = int.from_bytes(profile[:2], "little") if profile else 0
    if kind != _DRIVE_PROFILE:
        remedy = f"expected profile {_DRIVE_PROFILE}; check the node numbers"
        raise WiringError(objects.name, f"is a device of profile {kind}", remedy)
    serial, name = objects.read(0x1018, 4), objects.read(0x1008)
    text = "?" if name is None else name.rstrip(b"\0").decode("ascii", "replace")
    return text if serial is None else f"{text} ({int.from_bytes(serial, 'little')})"


def set_up(objects: Objects, joint: JointDrive, settings: ArmSettings) -> tuple[str, ...]:
    """Configure a pre-operational drive for cyclic operation; return notes on missing objects and their effects."""
    notes = list(arm_watchdog(objects, settings, on=False))
    for number in range(1, _PREDEFINED_PDOS):
        for base, first in ((_RPDO1_SETTINGS, RPDO1), (_TPDO1_SETTINGS, TPDO1)):
            # PDOs enabled by the manufacturer would exceed the bus budget.
            objects.write_if_known(base + number, 1, _INVALID | (first + 0x100 * number + joint.node), 4)
    _map(objects, _RPDO1_SETTINGS, _RPDO1_MAPPING, RPDO1 + joint.node, (_CONTROLWORD, _TARGET))
    _map(objects, _TPDO1_SETTINGS, _TPDO1_MAPPING, TPDO1 + joint.node, (_STATUSWORD, _POSITION, _MODE))
    objects.write(0x1017, 0, HEARTBEAT_MS, 2)
    # The drive spreads a step of its target over this time; a byte holds 140 Hz as 7.1 ms.
    tenths_of_ms = round(settings.period_s * 1e4)
    scale, ten_to = (tenths_of_ms, _TENTH_OF_MS) if tenths_of_ms <= 0xFF else (round(settings.period_s * 1e3), -3)
    if objects.write_if_known(0x60C2, 1, scale, 1):
        objects.write(0x60C2, 2, ten_to, 1)
    if not objects.write_if_known(0x605A, 0, _STAY_IN_QUICK_STOP, 2):
        notes.append(f"{objects.name} has no object 0x605A: it may be without power after a stop, on its brake")
    deceleration = round(settings.quick_stop_rad_per_s2 * abs(joint.counts_per_rad))
    if not objects.write_if_known(0x6085, 0, deceleration, 4):
        notes.append(f"{objects.name} has no object 0x6085: it stops as fast as its maker chose")
    objects.write(0x6060, 0, CSP, 1)
    shown = objects.read(0x6061)
    if shown is None or int.from_bytes(shown, "little", signed=True) != CSP:
        problem = f"does not take mode CSP ({CSP}); it shows {shown!r}"
        raise DeviceFaultError(objects.name, problem, "use a drive whose object 0x6502 offers it")
    return tuple(notes)


def arm_watchdog(objects: Objects, settings: ArmSettings, *, on: bool) -> tuple[str, ...]:
    """Set whether a drive stops when the host's heartbeat is lost; return notes on missing objects.

    Monitoring begins with the first heartbeat received (standard knowledge, CiA 301). A drive without this function
    holds its last target when it loses contact with the host.
    """
    stops = objects.write_if_known(0x6007, 0, _QUICK_STOP_WHEN_HOST_IS_LOST if on else 0, 2)
    host = settings.host_node << 16 | settings.host_watchdog_ms
    if not objects.write_if_known(0x1016, 1, host if on else 0, 4):
        return (f"{objects.name} has no object 0x1016: when this program dies, it holds its last set-point",)
    if not stops:
        return (f"{objects.name} has no object 0x6007: when this program dies, it does what its maker chose",)
    return ()


def _map(objects: Objects, settings_index: int, mapping_index: int, identifier: int, entries: tuple[int, ...]) -> None:
    objects.write(settings_index, 1, _INVALID | identifier, 4)
    objects.write(mapping_index, 0, 0, 1)
    for subindex, entry in enumerate(entries, 1):
        objects.write(mapping_index, subindex, entry, 4)
    objects.write(mapping_index, 0, len(entries), 1)
    objects.write(settings_index, 2, _EVERY_SYNC, 1)
    objects.write(settings_index, 1, identifier, 4)
