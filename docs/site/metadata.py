"""What a package index shows: the README and, once pyproject.toml names the repository, links that lead there.

Without an address nothing is invented: no project URLs, and a README without its pictures and with plain words for its
links.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURES = (".png", ".gif", ".svg")


class PackagePage(MetadataHookInterface):
    """Fills in what pyproject.toml calls dynamic."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Add readme and urls."""
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
