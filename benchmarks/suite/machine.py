"""What the figures were measured on."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from palpate.adapters.log.provenance import made_with

_PACKAGES = ("palpate", "mujoco", "pin", "numpy", "scipy", "torch")


def machine() -> dict[str, str]:
    """Processor, memory, system and versions, each in a few words."""
    versions = {name: version for name, version in made_with().items() if name in _PACKAGES}
    return {
        "processor": f"{processor()}, {os.cpu_count()} cores",
        "memory": f"{memory_GB():.0f} GB",
        "system": f"{platform.system()} {platform.release()}",
        "Python": platform.python_version(),
        **versions,
    }


def processor(cpuinfo: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name, as far as the system tells it."""
    try:
        lines = cpuinfo.read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def memory_GB() -> float:
    """Memory of the machine."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
