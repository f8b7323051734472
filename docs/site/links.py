"""Redirect the relative links of a Markdown page to pages of the site or to the repository."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import Final

LINK: Final = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
FENCED: Final = re.compile(r"(^```.*?^```)", re.DOTALL | re.MULTILINE)


def relinked(text: str, name: str, place_of: Callable[[str], str]) -> str:
    """Return a page with redirected links. Code blocks remain unchanged.

    Args:
        text: Markdown.
        name: Path of the page in the repository. Its links are relative to this path.
        place_of: Returns the new link target for a path in the repository, or an empty string if the file has no
            target. A link is then reduced to its text, and a picture is removed.
    """

    def moved(match: re.Match[str]) -> str:
        image, words, link = match.groups()
        path, hash_, anchor = link.partition("#")
        if not path or re.match(r"[a-z]+:", path):
            return match.group()
        place = place_of(os.path.normpath(os.path.join(os.path.dirname(name), path)))
        if place:
            return f"{image}[{words}]({place}{hash_}{anchor})"
        return "" if image else words

    parts = FENCED.split(text)
    return "".join(part if part.startswith("```") else LINK.sub(moved, part) for part in parts)


def in_repository(address: str, path: str, *, picture: bool) -> str:
    """Return the web address of a file, or an empty string if the repository address is not set."""
    return f"{address.rstrip('/')}/{'raw' if picture else 'blob'}/main/{path}" if address else ""
