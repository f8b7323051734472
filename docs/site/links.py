"""Leads the relative links of a Markdown page elsewhere: to pages of the site, or to the repository."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import Final

LINK: Final = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
FENCED: Final = re.compile(r"(^```.*?^```)", re.DOTALL | re.MULTILINE)


def relinked(text: str, name: str, place_of: Callable[[str], str]) -> str:
    """A page whose links lead elsewhere; blocks of code stay as they are.

    Args:
        text: Markdown.
        name: Path of the page in the repository, which its links are relative to.
        place_of: Where the file of that path in the repository is now, as it is to stand in the link; empty where it
            is nowhere: then a link's words are left, and of a picture nothing.
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
    """Address of a file on the web; empty while nobody has set the repository's."""
    return f"{address.rstrip('/')}/{'raw' if picture else 'blob'}/main/{path}" if address else ""
