"""Settings for a Net F/T box, read from its page ``/netftapi2.xml``. FACT: the fields are from firmware 2.2.59."""

import re
from contextlib import closing
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from math import isfinite
from typing import Final

from palpate.drivers.device import Vector3
from palpate.drivers.errors import SettingError, WiringError

NAME: Final = "ATI Net F/T"
CHECK: Final = "check the address in [force_sensor], the cable, and that this computer is in the same network"
_PAGE: Final = "/netftapi2.xml"
_MAX_BYTES: Final = 1 << 16
_REQUIRED: Final = {
    "scfgfu": (("N",), "set the force units to N on the page Configurations of the box, and apply"),
    "scfgtu": (("Nm", "N-m"), "set the torque units to Nm on the page Configurations of the box, and apply"),
    "comrdte": (("Enabled",), "enable RDT on the page Communications of the box"),
}


@dataclass(frozen=True, slots=True)
class NetFtBox:
    """Settings for a Net F/T box.

    Attributes:
        range_N: Rated forces, (3,).
        range_Nm: Rated torques, (3,).
        calibration: Calibration serial number.
    """

    counts_per_N: float
    counts_per_Nm: float
    range_N: Vector3
    range_Nm: Vector3
    rate_Hz: float
    calibration: str = ""


def read_box(host: str, port: int, timeout_s: float) -> NetFtBox:
    """Fetch and parse the settings page.

    Raises:
        WiringError: The page cannot be fetched.
        SettingError: See :func:`parse_box`.
    """
    try:
        with closing(HTTPConnection(host, port, timeout=timeout_s)) as connection:
            connection.request("GET", _PAGE)
            page = connection.getresponse().read(_MAX_BYTES)
    except (OSError, UnicodeError, HTTPException) as error:
        raise WiringError(NAME, f"http://{host}:{port}{_PAGE} cannot be fetched ({error})", CHECK) from error
    return parse_box(page)


def parse_box(page: bytes) -> NetFtBox:
    """Parse the settings page.

    Raises:
        SettingError: The box uses units other than N and N m, does not stream, or its page lacks a field.
    """
    fields = {tag: text.strip() for tag, text in re.findall(r"<(\w+)>([^<]*)</\1>", page.decode("utf-8", "replace"))}
    for tag, (accepted, remedy) in _REQUIRED.items():
        if (found := _field(fields, tag)) not in accepted:
            raise SettingError(NAME, f"its {tag} is {found}, not {accepted[0]}", remedy)
    fx, fy, fz, tx, ty, tz = _numbers(fields, "cfgmr", 6)
    (per_N,), (per_Nm,), (rate_Hz,) = (_numbers(fields, tag, 1) for tag in ("cfgcpf", "cfgcpt", "comrdtrate"))
    return NetFtBox(per_N, per_Nm, (fx, fy, fz), (tx, ty, tz), rate_Hz, fields.get("cfgcalsn", "unknown"))


def _field(fields: dict[str, str], tag: str) -> str:
    if tag not in fields:
        raise SettingError(NAME, f"its page {_PAGE} has no {tag}", "check that this address is a Net F/T's")
    return fields[tag]


def _numbers(fields: dict[str, str], tag: str, count: int) -> list[float]:
    text = _field(fields, tag)
    try:
        numbers = [float(word) for word in text.split(";")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(isfinite(x) and x > 0.0 for x in numbers):
        problem = f"its page {_PAGE} has {tag} = {text!r}"
        raise SettingError(NAME, problem, "check the page Configurations of the box")
    return numbers
