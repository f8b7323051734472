"""Messages that the robot publishes and receives, in plain CDR with ROS 2 type names."""

from collections.abc import Sequence
from typing import Any, Final

import cyclonedds.idl.annotations as annotate
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import float64, int32, sequence, uint32

_NS: Final = 1_000_000_000


def _struct(package: str, short: str, **fields: Any) -> Any:
    made = make_idl_struct(short, f"{package}::msg::dds_::{short}_", fields)
    return annotate.final(annotate.autoid("sequential")(made))


_Numbers: Final = sequence[float64]
_Time: Final = _struct("builtin_interfaces", "Time", sec=int32, nanosec=uint32)
_Header: Final = _struct("std_msgs", "Header", stamp=_Time, frame_id=str)
_Vector3: Final = _struct("geometry_msgs", "Vector3", x=float64, y=float64, z=float64)
_Wrench: Final = _struct("geometry_msgs", "Wrench", force=_Vector3, torque=_Vector3)
_Dimension: Final = _struct("std_msgs", "MultiArrayDimension", label=str, size=uint32, stride=uint32)
_Layout: Final = _struct("std_msgs", "MultiArrayLayout", dim=sequence[_Dimension], data_offset=uint32)
JointState: Final = _struct(
    "sensor_msgs", "JointState", header=_Header, name=sequence[str], position=_Numbers, velocity=_Numbers,
    effort=_Numbers,
)  # fmt: skip
WrenchStamped: Final = _struct("geometry_msgs", "WrenchStamped", header=_Header, wrench=_Wrench)
Float64MultiArray: Final = _struct("std_msgs", "Float64MultiArray", layout=_Layout, data=_Numbers)


def _header(stamp_ns: int, frame: str) -> Any:
    return _Header(_Time(stamp_ns // _NS, stamp_ns % _NS), frame)


def joint_state(stamp_ns: int, names: Sequence[str], angles_rad: Sequence[float]) -> Any:
    """Return a message with joint angles."""
    return JointState(_header(stamp_ns, ""), list(names), list(angles_rad), [], [])


def wrench(stamp_ns: int, frame: str, parts: Sequence[float]) -> Any:
    """Return a message with the force and torque, (6,)."""
    return WrenchStamped(_header(stamp_ns, frame), _Wrench(_Vector3(*parts[:3]), _Vector3(*parts[3:])))
