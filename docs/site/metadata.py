"""Generate the metadata for a package index: the README and, if pyproject.toml names the repository, project URLs.

Without a repository address there are no project URLs, and the README has neither pictures nor links.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURES = (".png", ".gif", ".svg")


class PackagePage(MetadataHookInterface):
    """Set the fields that pyproject.toml declares as dynamic."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the readme and urls fields."""
        root, address = Path(self.root), str(self.config["repository"])
        links = runpy.run_path(str(root / "docs" / "site" / "links.py"))

        def place_of(path: str) -> str:
            return str(links["in_repository"](address, path, picture=path.endswith(PICTURES)))

        text = links["relinked"]((root / "README.md").read_text(encoding="utf-8"), "README.md", place_of)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
        pages = {"Documentation": "docs/README.md", "Changelog": "CHANGELOG.md"} if address else {}
        metadata["urls"] = {name: place_of(path) for name, path in pages.items()}
        if address:
            metadata["urls"]["Repository"] = address
