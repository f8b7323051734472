"""Sets of strings as text files, one string a line.

::

    # alphabet: A B C
    ABBA
    CAB

Lines that begin with ``#`` and blank lines say nothing, except ``# alphabet:``, which names the symbols in order;
without it they are those that occur, in alphabetical order.

Symbols are single letters, one after the other. If any line has blanks between symbols, or the alphabet has a name of
more than one letter, then symbols are what stands between blanks, on every line. A blank inside a name is written as
``~``: ``x-~y0`` is the symbol ``x- y0``.

If any line has a tab, then the strings are labelled: every line begins with ``1`` (accepted) or ``0`` (rejected) and a
tab. Behind ``1`` and the tab may be nothing: the empty string. Why a tab: in ``1 0 1`` the first 1 could be a symbol.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from palpate.core.automata.strings import Strings
from palpate.core.errors import ConfigurationError, OutputError

_COMMENT: Final = "#"
_ALPHABET: Final = "# alphabet:"
_BLANK: Final = "~"
_LABELS: Final = {"1": True, "0": False}


def read_strings(path: str | os.PathLike[str], alphabet: tuple[str, ...] | None = None) -> Strings:
    """Read a file of strings.

    Args:
        path: The file.
        alphabet: Names of the symbols, in order; None takes what the file says.

    Raises:
        ConfigurationError: No such file, a line that cannot be read, a symbol outside the alphabet, or no usable set of
            strings (see :class:`~palpate.core.automata.strings.Strings`).
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError("strings.file", str(path), "a readable text file in UTF-8") from error
    return strings_of(text, alphabet)


def strings_of(text: str, alphabet: tuple[str, ...] | None = None) -> Strings:
    """Read strings from the text of a file; see :func:`read_strings`."""
    lines = {place: line.rstrip("\r") for place, line in enumerate(text.split("\n"), start=1)}
    headers = [line for line in lines.values() if line.startswith(_ALPHABET)]
    if alphabet is None and headers:
        alphabet = tuple(_name(word) for word in headers[0].removeprefix(_ALPHABET).split())
    told = {place: line for place, line in lines.items() if line.strip() and not line.startswith(_COMMENT)}
    labelled = any("\t" in line for line in told.values())
    labels: list[bool] = []
    bodies: dict[int, str] = {}
    for place, line in told.items():
        label, _, rest = line.partition("\t") if labelled else ("", "", line)
        if labelled:
            if label.strip() not in _LABELS or "\t" in rest:
                raise ConfigurationError(f"strings.line[{place}]", line, "1 or 0, a tab, and the string")
            labels.append(_LABELS[label.strip()])
        bodies[place] = rest.strip()
    apart = any(" " in body for body in bodies.values()) or any(len(name) > 1 for name in alphabet or ())
    words = {place: [_name(word) for word in body.split()] if apart else list(body) for place, body in bodies.items()}
    if apart and not labelled and alphabet is None and all(word[0] in _LABELS for word in words.values()):
        place = min(words)
        accepted = "a tab, not a blank, between label and string, or '# alphabet: 0 1' if it is no label"
        raise ConfigurationError(f"strings.line[{place}]", told[place], accepted)
    if alphabet is not None:
        for place, word in words.items():
            for name in word:
                if name not in alphabet:
                    accepted = f"symbols of the alphabet {' '.join(alphabet)}"
                    raise ConfigurationError(f"strings.line[{place}]", name, accepted)
    return Strings.of(words.values(), labels, alphabet=alphabet)


def text_of(strings: Strings) -> str:
    """Write strings as the text of a file.

    Raises:
        ConfigurationError: A symbol's name cannot be written: it has a ``#``, a ``~``, or white space other than
            single blanks inside.
    """
    for name in strings.alphabet:
        if _COMMENT in name or _BLANK in name or " ".join(name.split()) != name:
            raise ConfigurationError("strings.alphabet", name, "names without # and ~, and with single blanks only")
    names = [name.replace(" ", _BLANK) for name in strings.alphabet]
    between = " " if any(len(name) > 1 for name in names) else ""
    lines = [f"{_ALPHABET} {' '.join(names)}"]
    for place, word in enumerate(strings.words):
        body = between.join(names[symbol] for symbol in word)
        lines.append(f"{int(strings.labels[place])}\t{body}" if strings.labels else body)
    return "\n".join(lines) + "\n"


def write_strings(strings: Strings, path: str | os.PathLike[str]) -> None:
    """Write a file that :func:`read_strings` reads back as it was; an older one of the name is replaced.

    Raises:
        ConfigurationError: A symbol's name cannot be written.
        OutputError: The place cannot be written to.
    """
    text = text_of(strings)
    try:
        Path(path).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise OutputError(str(path), f"cannot be written ({error.strerror})", "choose another place") from error


def _name(word: str) -> str:
    return word.replace(_BLANK, " ")
