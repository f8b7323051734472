"""Lets Python import one checkout and nothing of the one that is installed, entry points included."""

from __future__ import annotations

import tomllib
from pathlib import Path

from benchmarks.house import ROOTS


def import_path(checkout: Path, metadata: Path) -> list[str]:
    """What has to come first on the path; writes the checkout's metadata into a folder, made for that.

    Without metadata of its own a checkout would be given the adapters of the installed one by its entry points.
    """
    project = tomllib.loads((checkout / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    info = metadata / f"{project['name']}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (info / "METADATA").write_text(head, encoding="utf-8")
    groups = {"console_scripts": project.get("scripts", {}), **project.get("entry-points", {})}
    lines = []
    for group, points in groups.items():
        lines += [f"[{group}]", *(f"{name} = {target}" for name, target in points.items()), ""]
    (info / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
    return [str(metadata), *(str(checkout / root) for root in ROOTS)]
