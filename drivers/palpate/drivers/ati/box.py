"""What a Net F/T box states on its page ``/netftapi2.xml``; FACT, fields as firmware 2.2.59 sends them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Final

from palpate.drivers.device import Vector3
from palpate.drivers.errors import SettingError

_NAME: Final = "ATI Net F/T"
PAGE: Final = "/netftapi2.xml"
_SCALING: Final = {
    "configuration": "setcfgsel", "calibration": "cfgcalsn", "force units": "scfgfu", "torque units": "scfgtu",
    "counts per force": "cfgcpf", "counts per torque": "cfgcpt", "tool frame": "cfgtfx", "bias": "setbias",
}  # fmt: skip
_UNITS: Final = {"scfgfu": ("force", ("N",)), "scfgtu": ("torque", ("Nm", "N-m"))}


@dataclass(frozen=True, slots=True)
class NetFtBox:
    """The box as it is set.

    Attributes:
        range_N: Rated forces, (3,).
        range_Nm: Rated torques, (3,).
        sample_Hz: Rate of its own samples, which it counts; 0 where the page does not say.
        scaling: What scales, turns and shifts its counts, as :func:`scaling` has it.
    """

    counts_per_N: float
    counts_per_Nm: float
    range_N: Vector3
    range_Nm: Vector3
    rate_Hz: float
    calibration: str = ""
    firmware: str = ""
    sample_Hz: float = 0.0
    scaling: Mapping[str, str] = field(default_factory=dict, compare=False)


def parse_box(page: bytes) -> NetFtBox:
    """Read the page.

    Raises:
        SettingError: The box is set to units other than N and N m, or does not stream; says what to change on it.
            Or the page lacks a field, or holds no number there: it is no Net F/T's, or of one that is not set up.
    """
    for tag, (what, accepted) in _UNITS.items():
        if (unit := _field(page, tag)) not in accepted:
            remedy = f"set the {what} units to {accepted[0]} on the page Configurations of the box, and apply"
            raise SettingError(_NAME, f"it is set to a {what} in {unit}, not in {accepted[0]}", remedy)
    if _field(page, "comrdte") != "Enabled":
        raise SettingError(_NAME, "its RDT interface is off", "enable RDT on the page Communications of the box")
    fx, fy, fz, tx, ty, tz = _numbers(page, "cfgmr", 6)
    (per_N,), (per_Nm,), (rate_Hz,) = (_numbers(page, tag, 1) for tag in ("cfgcpf", "cfgcpt", "comrdtrate"))
    (sample_Hz,) = _numbers(page, "runrate", 1) if _field(page, "runrate", "") else (0.0,)
    told = _field(page, "cfgcalsn", "unknown"), _field(page, "mfgdigver", "unknown"), sample_Hz
    return NetFtBox(per_N, per_Nm, (fx, fy, fz), (tx, ty, tz), rate_Hz, *told, scaling(page))


def scaling(page: bytes) -> dict[str, str]:
    """What scales, turns and shifts the counts of its records, by name; empty where the page is not whole.

    Records say none of it, and any client of the box may change it while they come. FACT, ATI 9610-05 (Ethernet Axia),
    11.1: the page is that of the active configuration. INFERENCE: so it is on a Net F/T, and a bias shows there.
    """
    return {name: _field(page, tag, "") for name, tag in _SCALING.items()} if b"</netft>" in page else {}


def _field(page: bytes, tag: str, default: str | None = None) -> str:
    found = re.search(rb"<%b>([^<]*)</%b>" % (tag.encode(), tag.encode()), page)
    if found is not None:
        return found[1].decode("utf-8", "replace").strip()
    if default is None:
        raise SettingError(_NAME, f"its page {PAGE} has no {tag}", "check that this address is a Net F/T's")
    return default


def _numbers(page: bytes, tag: str, count: int) -> list[float]:
    text = _field(page, tag)
    try:
        numbers = [float(word) for word in text.split(";")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(isfinite(x) and x > 0.0 for x in numbers):
        raise SettingError(
            _NAME, f"its page {PAGE} says {tag} = {text!r}", "look at the page Configurations of the box"
        )
    return numbers
