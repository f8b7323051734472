"""Check an arm's URDF before passing it to Pinocchio, which would crash on a graph that is not a tree.

Limits from the arm's table and a calibration from its controller are inserted, so both libraries use the same source.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from math import hypot, inf, isfinite, pi
from pathlib import Path
from typing import Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from palpate.core.errors import AssetError
from palpate.core.motion.arm import ArmDescription

_XACRO: Final = "no plain URDF: run xacro first, as in: xacro robot.urdf.xacro > robot.urdf"
_MOST_RAD: Final = 4.0 * pi
"""Maximum joint angle, two turns from zero; 360 degrees read as radians would be 57 turns."""
_FARTHEST_M: Final = 10.0
"""Maximum total distance between an arm's joints; even a small arm specified in millimetres exceeds it."""
_UNIT: Final = 1e-2
"""Error in an axis's length caused by rounding to two digits."""
_CALIBRATED: Final = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
_ENTRY: Final = re.compile(r"\s*(\w+):\s*([^\s#]*)")
_CALIBRATED_M, _CALIBRATED_RAD = 0.05, 0.1
"""Maximum joint shift in a calibration. Real calibrations shift joints by a few millimetres at most."""

Refusal = Callable[[str], AssetError]


def prepared_urdf(
    arm: ArmDescription, path: Path, content: bytes, calibration: bytes = b""
) -> tuple[str, tuple[str, ...]]:
    """Return the URDF for Pinocchio, and the names of the joints that move the flange, base first.

    Args:
        content: Contents of the file, in its declared encoding.
        calibration: Origins of six joints in the format used by Universal Robots' ROS 2 driver; empty keeps the URDF's.

    Raises:
        AssetError: The file is not a URDF or not a tree, or its joints are unsuitable.
    """

    def refused(accepted: str) -> AssetError:
        return AssetError("arm", str(path), accepted)

    root = _root(content, refused)
    moving = _chain(arm, _joints_above(root, refused), refused)
    if calibration:
        _calibrate(moving, calibration, arm.calibration)
    for number, joint in enumerate(moving):
        _set_limits(arm, number, joint, refused)
        _set_axis(joint, refused)
    return ElementTree.tostring(root, "unicode"), tuple(joint.get("name", "") for joint in moving)


def _root(content: bytes, refused: Refusal) -> Element:
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        # LookupError and ValueError: an unknown encoding.
        raise refused(_XACRO if "unbound prefix" in str(error) else f"no readable URDF ({error})") from error
    if root.tag != "robot":
        raise refused(f"no readable URDF (its outermost element is {root.tag!r}, not 'robot')")
    for link in root.findall("link"):
        # Meshes and materials are ignored.
        for seen in (*link.findall("visual"), *link.findall("collision")):
            link.remove(seen)
    if any("xacro}" in each.tag or any("${" in text for text in each.attrib.values()) for each in root.iter()):
        raise refused(_XACRO)
    for each in root.iter():
        for key in ("xyz", "rpy"):
            if not all(map(isfinite, _numbers(each, key, "0 0 0"))):
                raise refused(f"no three numbers in {key}={each.get(key)!r}")
    return root


def _joints_above(root: Element, refused: Refusal) -> dict[str, Element]:
    """Return the joint above each link, except the base."""
    named = [link.get("name", "") for link in root.findall("link")]
    links = set(named)
    above: dict[str, Element] = {}
    for joint in root.findall("joint"):
        parent, child = _link(joint, "parent"), _link(joint, "child")
        # Pinocchio finds frames by name alone, and a joint may have the name of a link, or none.
        name = joint.get("name") or f"joint above {child}"
        joint.set("name", name if name not in links else f"joint {name}")
        if missing := {parent, child} - links:
            raise refused(f"no link {min(missing)!r}, which {name!r} connects")
        if child in above:
            raise refused(f"no tree: {child!r} is below both {above[child].get('name')!r} and {name!r}")
        above[child] = joint
    joints = [joint.get("name", "") for joint in above.values()]
    for name in {*named, *joints}:
        if named.count(name) + joints.count(name) > 1:
            raise refused(f"no unique names: {name!r} occurs twice")
    for link in above:
        seen, at = [link], _link(above[link], "parent")
        while at in above and at not in seen:
            seen.append(at)
            at = _link(above[at], "parent")
        if at == link:
            raise refused(f"no tree: links {', '.join(map(repr, reversed(seen)))} are a loop")
    if len(roots := [link for link in named if link not in above]) > 1:
        raise refused(f"no tree: no joint connects {' and '.join(map(repr, roots))}")
    return above


def _chain(arm: ArmDescription, above: Mapping[str, Element], refused: Refusal) -> list[Element]:
    """Return the joints that move the flange, base first."""
    if arm.flange not in above:
        raise refused(f"no link {arm.flange!r} below a joint, for the flange")
    moving: list[Element] = []
    at, length_m = arm.flange, 0.0
    while (joint := above.get(at)) is not None:
        kind, mimic = joint.get("type"), joint.find("mimic") is not None
        if mimic or kind not in ("fixed", "revolute", "continuous"):
            what = "mimic" if mimic else kind
            raise refused(f"no chain of revolute joints to {arm.flange!r}: {joint.get('name')!r} is {what}")
        if kind != "fixed":
            moving.insert(0, joint)
        length_m += hypot(*_numbers(joint.find("origin"), "xyz", "0 0 0"))
        at = _link(joint, "parent")
    if len(moving) not in (6, 7) or len(moving) != len(arm.posture_rad):
        wanted = "6 or 7 joints" if len(moving) not in (6, 7) else f"{len(arm.posture_rad)} joints, as in posture_rad,"
        raise refused(f"no chain of {wanted} to {arm.flange!r}: it has {len(moving)}")
    if length_m > _FARTHEST_M:
        raise refused(f"no lengths in metres: its joints are {length_m:.4g} m apart in total, as if in millimetres")
    return moving


def _set_limits(arm: ArmDescription, number: int, joint: Element, refused: Refusal) -> None:
    """Insert the limits from the arm's table; reject joints that still lack limits."""
    name, limit = joint.get("name"), joint.find("limit")
    if limit is None:
        limit = ElementTree.SubElement(joint, "limit")
    joint.set("type", "revolute")
    found = {"lower": "0", "upper": "0", "effort": "0", **limit.attrib}
    if _number(found["lower"]) == _number(found["upper"]):
        del found["lower"], found["upper"]
    given = {"lower": arm.lower_rad, "upper": arm.upper_rad, "velocity": arm.velocity_limit_rad_s}
    found |= {key: repr(values[number]) for key, values in given.items() if values}
    lower, upper, velocity = (_number(found.get(key, "nan")) for key in given)
    if not isfinite(lower) or not isfinite(upper):
        remedy = "state [arm] lower_rad and upper_rad, or <limit lower= upper= /> in the URDF"
        raise refused(f"no limits of {name!r}: {remedy}")
    if max(-lower, upper) > _MOST_RAD:
        problem = f"{lower:g} to {upper:g} is more than two turns and looks like degrees"
        raise refused(f"no limits of {name!r} in rad: {problem}; state [arm] lower_rad and upper_rad")
    if not 0.0 < velocity < inf:
        raise refused(f"no speed of {name!r}: state [arm] velocity_limit_rad_s, or <limit velocity= /> in the URDF")
    limit.attrib.update(found)


def _set_axis(joint: Element, refused: Refusal) -> None:
    axis = joint.find("axis")
    x, y, z = _numbers(axis, "xyz", "1 0 0")
    length = hypot(x, y, z)
    if abs(length - 1.0) > _UNIT:
        raise refused(f"no valid axis of {joint.get('name')!r}: the length of {x:g} {y:g} {z:g} is not 1")
    if axis is not None and length != 1.0:
        axis.set("xyz", f"{x / length!r} {y / length!r} {z / length!r}")


def _calibrate(moving: Sequence[Element], content: bytes, path: str) -> None:
    """Replace the joint origins with those from a calibration."""

    def refused(accepted: str) -> AssetError:
        return AssetError("arm.calibration", path, accepted)

    found: dict[str, dict[str, float]] = {}
    section = ""
    for line in content.decode("utf-8", "replace").splitlines():
        if (entry := _ENTRY.match(line)) is None:
            continue
        key, value = entry.groups()
        if value:
            found.setdefault(section, {})[key] = _number(value)
        else:
            section = key
    if len(moving) != len(_CALIBRATED):
        raise refused("no calibration is possible for an arm of 7 joints")
    for joint, name in zip(moving, _CALIBRATED, strict=True):
        figures = [found.get(name, {}).get(key, float("nan")) for key in ("x", "y", "z", "roll", "pitch", "yaw")]
        if not all(map(isfinite, figures)):
            raise refused(f"no x, y, z, roll, pitch and yaw of {name} as Universal Robots' ROS 2 driver writes them")
        origin = joint.find("origin")
        before = _placement([*_numbers(origin, "xyz", "0 0 0"), *_numbers(origin, "rpy", "0 0 0")])
        off = before.actInv(_placement(figures))
        away_m, turned_rad = hypot(*off.translation), hypot(*pin.log3(off.rotation))
        if away_m > _CALIBRATED_M or turned_rad > _CALIBRATED_RAD:
            shift = f"{away_m * 1e3:.0f} mm and {turned_rad:.2g} rad"
            raise refused(f"no calibration of this arm: it shifts {joint.get('name')!r} by {shift}")
        if origin is None:
            origin = ElementTree.SubElement(joint, "origin")
        origin.set("xyz", " ".join(map(repr, figures[:3])))
        origin.set("rpy", " ".join(map(repr, figures[3:])))


def _placement(figures: Sequence[float]) -> pin.SE3:
    return pin.SE3(pin.rpy.rpyToMatrix(*figures[3:]), np.array(figures[:3]))


def _link(joint: Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _numbers(element: Element | None, key: str, usual: str) -> list[float]:
    """Return the three numbers in an attribute, with NaN for each invalid entry."""
    words = (usual if element is None else element.get(key, usual)).split()
    return [_number(word) for word in words] if len(words) == 3 else [float("nan")] * 3
