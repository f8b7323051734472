"""Factors other than the configuration that affect a result: versions, source, arm model and processor."""

import hashlib
import platform
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

import palpate.core
from palpate.core.motion import ArmDescription, ToolGeometry, arm_named

_FUSED: Final = frozenset({"FMA3", "X86_V3"})
"""Current and former numpy names of processor features that include fused multiply-add."""


def made_with() -> dict[str, str]:
    """Return the versions that results depend on."""
    return dict(_versions())


@cache
def _versions() -> tuple[tuple[str, str], ...]:
    return tuple((name, version(name)) for name in ("palpate", "numpy", "scipy", "pin", "mujoco"))


@cache
def core_sha256() -> str:
    """Return a digest of the core's source; identical digests mean identical code."""
    return source_sha256([str(Path(str(palpate.core.__file__)).parent)])


def source_sha256(roots: Iterable[str]) -> str:
    """Return a digest of all source files in these folders. Files in earlier folders shadow those in later ones."""
    digest, files = hashlib.sha256(), dict[str, Path]()
    for root in roots:
        files = {path.relative_to(root).as_posix(): path for path in Path(root).rglob("*.py")} | files
    for name in sorted(files):
        digest.update(name.encode() + b"\0" + files[name].read_bytes())
    return digest.hexdigest()


@cache
def arm_sha256(named: str | ArmDescription, tool: ToolGeometry) -> str:
    """Return a digest of the kinematics: the arm's URDF and calibration, the tool, and the encoders."""
    arm = arm_named(named)
    own = (arm.tool_axis, arm.lower_rad, arm.upper_rad, arm.velocity_limit_rad_s)
    facts = (arm.flange, arm.encoder_step_rad, tool, own)
    calibration = Path(arm.calibration).read_bytes() if arm.calibration else b""
    return hashlib.sha256(arm.find_urdf().read_bytes() + calibration + b"\0" + repr(facts).encode()).hexdigest()


@cache
def processor() -> dict[str, Any]:
    """Return processor properties that may affect the last bits of sines, exponentials and matrix products."""
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
    """Return the properties of :func:`processor` that do affect the least significant bits of a trial (record 0015).

    They may account for a difference between logs. The C library's sine on x86-64 has one version for processors with
    fused multiply-add and one for others. BLAS kernels and numpy's vector loops have no effect.
    """
    simd: Any = found.get("simd") or []
    if found.get("machine") == "x86_64":
        simd = not _FUSED.isdisjoint(simd)
    return found.get("machine"), found.get("libc"), simd
