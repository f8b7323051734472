"""The kinematic chain of an arm, out of its URDF."""

from pathlib import Path
from xml.etree import ElementTree

import pinocchio as pin

from palpate.core.errors import AssetError
from palpate.core.motion.arm import ArmDescription


def load_model(arm: ArmDescription) -> tuple[pin.Model, pin.Frame]:
    """Pinocchio's model of the joints that lead to the flange, and the flange's frame.

    What else the URDF has, such as a gripper's fingers, is held where its joints are zero. Meshes are not looked for.

    Raises:
        AssetError: The file is missing or no URDF, or what leads to its flange are not six or seven revolute joints.
    """
    path = arm.find_urdf()
    try:
        chain = _chain(arm, path, ElementTree.fromstring(path.read_bytes()))
        model = pin.buildModelFromUrdf(str(path))
    except OSError as error:
        raise AssetError("arm", str(path), f"a readable URDF ({error.strerror})") from error
    except (ElementTree.ParseError, ValueError, RuntimeError) as error:
        if isinstance(error, AssetError):
            raise
        raise AssetError("arm", str(path), f"a readable URDF ({' '.join(str(error).split())})") from error
    others = [index for index in range(1, model.njoints) if model.names[index] not in chain]
    if others:
        model = pin.buildReducedModel(model, others, pin.neutral(model))
    return model, model.frames[model.getFrameId(arm.flange)]


def _chain(arm: ArmDescription, path: Path, root: ElementTree.Element) -> list[str]:
    """Names of the joints that move the flange."""
    if root.tag != "robot":
        raise AssetError("arm", str(path), f"a readable URDF (its outermost element is {root.tag!r}, not 'robot')")
    if not any(link.get("name") == arm.flange for link in root.findall("link")):
        raise AssetError("arm", str(path), f"a URDF with a frame {arm.flange!r} for the flange")
    above = {child.get("link"): joint for joint in root.findall("joint") if (child := joint.find("child")) is not None}
    moving: list[str] = []
    link: str | None = arm.flange
    while (joint := above.pop(link, None)) is not None:
        name, kind, parent = joint.get("name", ""), joint.get("type"), joint.find("parent")
        if kind not in ("fixed", "revolute") or joint.find("mimic") is not None:
            what = "mimic" if kind == "revolute" else kind
            accepted = f"a URDF with revolute joints only up to {arm.flange!r}; {name!r} is {what}"
            if kind == "continuous":
                accepted += ": write revolute, with the limits of its cable"
            raise AssetError("arm", str(path), accepted)
        moving += [name] if kind == "revolute" else []
        link = None if parent is None else parent.get("link")
    if len(moving) not in (6, 7) or len(moving) != len(arm.posture_rad):
        wanted = "6 or 7 joints" if len(moving) not in (6, 7) else f"{len(arm.posture_rad)} joints, as in posture_rad,"
        raise AssetError("arm", str(path), f"a URDF in which {wanted} lead to {arm.flange!r}, not {len(moving)}")
    return moving
