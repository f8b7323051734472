"""ROS 2 messages as DDS types with rmw names, and their ROS 2 type hashes."""

from typing import Any, Final

import cyclonedds.idl.annotations as annotate
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import float64, int32, sequence, uint32

from palpate.drivers.ros2.settings import COMMANDS, JOINT_STATE, WRENCH

_HASHES: Final = {
    JOINT_STATE: "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    WRENCH: "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
    COMMANDS: "1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f",
}


def _message(name: str, /, **fields: Any) -> Any:
    package, _, short = name.partition("/msg/")
    made = make_idl_struct(short, f"{package}::msg::dds_::{short}_", fields)
    return annotate.final(annotate.autoid("sequential")(made))


_Numbers: Final = sequence[float64]
_Time: Final = _message("builtin_interfaces/msg/Time", sec=int32, nanosec=uint32)
_Header: Final = _message("std_msgs/msg/Header", stamp=_Time, frame_id=str)
_Vector3: Final = _message("geometry_msgs/msg/Vector3", x=float64, y=float64, z=float64)
_Wrench: Final = _message("geometry_msgs/msg/Wrench", force=_Vector3, torque=_Vector3)
_Dimension: Final = _message("std_msgs/msg/MultiArrayDimension", label=str, size=uint32, stride=uint32)
_Layout: Final = _message("std_msgs/msg/MultiArrayLayout", dim=sequence[_Dimension], data_offset=uint32)
_Names: Final = sequence[str]
_JointState: Final = _message(
    JOINT_STATE, header=_Header, name=_Names, position=_Numbers, velocity=_Numbers, effort=_Numbers
)
_Commands: Final = _message(COMMANDS, layout=_Layout, data=_Numbers)
TYPES: Final = {JOINT_STATE: _JointState, WRENCH: _message(WRENCH, header=_Header, wrench=_Wrench), COMMANDS: _Commands}
"""DDS types by ROS 2 name."""


def command(values: list[float]) -> Any:
    """Return a message with one number per joint."""
    return _Commands(_Layout([], 0), values)


def user_data(kind: str) -> bytes:
    """Return an endpoint's user data, which contain the version of its type, as in rmw_dds_common."""
    return f"typehash=RIHS01_{_HASHES[kind]};".encode()
