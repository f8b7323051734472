"""What results depend on besides the configuration: versions, source, arm model, processor."""

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

import palpate.core
from palpate.core.motion import ArmDescription, ToolGeometry, arm_named

_FUSED: Final = frozenset({"FMA3", "X86_V3"})
"""Names that numpy has, or had, for what comes with fused multiply-add."""


def made_with() -> dict[str, str]:
    """Versions that results depend on."""
    return dict(_versions())


@cache
def _versions() -> tuple[tuple[str, str], ...]:
    return tuple((name, version(name)) for name in ("palpate", "numpy", "scipy", "pin", "mujoco"))


@cache
def core_sha256() -> str:
    """Digest of the core's source: equal digests, equal core."""
    digest = hashlib.sha256()
    root = Path(str(palpate.core.__file__)).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@cache
def arm_sha256(named: str | ArmDescription, tool: ToolGeometry) -> str:
    """Digest of what the kinematics are made of: URDF and calibration of the arm, its tool, and its encoders."""
    arm = arm_named(named)
    own = (arm.tool_axis, arm.lower_rad, arm.upper_rad, arm.velocity_limit_rad_s)
    facts = (arm.flange, arm.encoder_step_rad, tool, own)
    calibration = Path(arm.calibration).read_bytes() if arm.calibration else b""
    return hashlib.sha256(arm.find_urdf().read_bytes() + calibration + b"\0" + repr(facts).encode()).hexdigest()


@cache
def processor() -> dict[str, Any]:
    """What the last bits of sines, exponentials and matrix products may depend on."""
    from threadpoolctl import threadpool_info

    simd: Any = np.show_config(mode="dicts")
    found = simd.get("SIMD Extensions", {}) if isinstance(simd, dict) else {}
    return {
        "machine": platform.machine(),
        "simd": sorted({*found.get("baseline", []), *found.get("found", [])}),
        "blas": sorted({str(i.get("architecture")) for i in threadpool_info() if i.get("user_api") == "blas"}),
        "libc": " ".join(platform.libc_ver()),
    }


def decisive(found: Mapping[str, Any]) -> tuple[Any, ...]:
    """What of :func:`processor` the last bits of a trial do depend on, and may excuse a difference (record 0015).

    That is the C library's sine, which on x86-64 has a form for processors with fused multiply-add, and one for those
    without. The kernels of BLAS and numpy's vector loops play no part.
    """
    simd: Any = found.get("simd") or []
    if found.get("machine") == "x86_64":
        simd = not _FUSED.isdisjoint(simd)
    return found.get("machine"), found.get("libc"), simd
