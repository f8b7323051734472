"""The settings of a Net F/T box, from its page ``/netftapi2.xml``; FACT, fields as firmware 2.2.59 sends them."""

import re
import socket
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from math import isfinite
from typing import Final

from palpate.drivers.device import Vector3
from palpate.drivers.errors import SettingError, WiringError

NAME: Final = "ATI Net F/T"
CHECK: Final = "check the address in [force_sensor], the cable, and that this computer is in the same network"
_PAGE: Final = "/netftapi2.xml"
_MOST_BYTES: Final = 1 << 16
_UNITS: Final = {"scfgfu": ("force", ("N",)), "scfgtu": ("torque", ("Nm", "N-m"))}


@dataclass(frozen=True, slots=True)
class NetFtBox:
    """The settings of the box.

    Attributes:
        range_N: Rated forces, (3,).
        range_Nm: Rated torques, (3,).
        sample_Hz: Rate of its own samples, which it counts; 0 where the page does not say.
    """

    counts_per_N: float
    counts_per_Nm: float
    range_N: Vector3
    range_Nm: Vector3
    rate_Hz: float
    calibration: str = ""
    firmware: str = ""
    sample_Hz: float = 0.0


def ip_address(host: str) -> str:
    """The one address for page and stream; a box has IPv4 alone.

    Raises:
        WiringError: There is none.
    """
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError) as error:
        raise WiringError(NAME, f"{host} has no address ({error})", CHECK) from error


def fetch_page(address: str, port: int, timeout_s: float) -> bytes:
    """Fetch the page.

    Args:
        timeout_s: Longest wait for each part of it.

    Raises:
        WiringError: The page cannot be fetched.
        SettingError: The server has no such page.
    """
    connection = HTTPConnection(address, port, timeout=timeout_s)
    url = f"http://{address}:{port}{_PAGE}"
    try:
        connection.request("GET", _PAGE)
        answer = connection.getresponse()
        page = answer.read(_MOST_BYTES)
    except (OSError, HTTPException) as error:
        raise WiringError(NAME, f"{url} cannot be fetched ({error})", CHECK) from error
    finally:
        connection.close()
    if answer.status != 200:
        raise SettingError(NAME, f"{url} answers {answer.status}", "check that this address is a Net F/T's")
    return page


def parse_box(page: bytes) -> NetFtBox:
    """Read the page.

    Raises:
        SettingError: The box is set to units other than N and N m, does not stream, or the page lacks a field.
    """
    for tag, (what, accepted) in _UNITS.items():
        if (unit := _field(page, tag)) not in accepted:
            remedy = f"set the {what} units to {accepted[0]} on the page Configurations of the box, and apply"
            raise SettingError(NAME, f"it is set to a {what} in {unit}, not in {accepted[0]}", remedy)
    if _field(page, "comrdte") != "Enabled":
        raise SettingError(NAME, "its RDT interface is off", "enable RDT on the page Communications of the box")
    fx, fy, fz, tx, ty, tz = _numbers(page, "cfgmr", 6)
    (per_N,), (per_Nm,), (rate_Hz,) = (_numbers(page, tag, 1) for tag in ("cfgcpf", "cfgcpt", "comrdtrate"))
    (sample_Hz,) = _numbers(page, "runrate", 1) if _field(page, "runrate", "") else (0.0,)
    calibration, firmware = _field(page, "cfgcalsn", "unknown"), _field(page, "mfgdigver", "unknown")
    return NetFtBox(per_N, per_Nm, (fx, fy, fz), (tx, ty, tz), rate_Hz, calibration, firmware, sample_Hz)


def _field(page: bytes, tag: str, default: str | None = None) -> str:
    found = re.search(rb"<%b>([^<]*)</%b>" % (tag.encode(), tag.encode()), page)
    if found is not None:
        return found[1].decode("utf-8", "replace").strip()
    if default is None:
        raise SettingError(NAME, f"its page {_PAGE} has no {tag}", "check that this address is a Net F/T's")
    return default


def _numbers(page: bytes, tag: str, count: int) -> list[float]:
    text = _field(page, tag)
    try:
        numbers = [float(word) for word in text.split(";")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(isfinite(x) and x > 0.0 for x in numbers):
        raise SettingError(
            NAME, f"its page {_PAGE} says {tag} = {text!r}", "look at the page Configurations of the box"
        )
    return numbers
