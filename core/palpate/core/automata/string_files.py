"""Files of strings: letters or words, labels and pairs as text, one string a line."""

import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Final

from palpate.core.automata.letters import BETWEEN, END, letters_of
from palpate.core.automata.strings import Strings, brief
from palpate.core.errors import ConfigurationError
from palpate.core.ports import read_text, write_whole

_COMMENT: Final = "#"
_ALPHABET: Final = "# alphabet:"
_ACTIONS: Final = "# actions:"
_BLANK: Final = "~"
_LABELS: Final = {"1": True, "0": False}


def read_strings(path: str | os.PathLike[str]) -> Strings:
    """Read a file of strings.

    Raises:
        ConfigurationError: No such file, a line that cannot be read, a symbol outside the file's alphabet, or no usable
            set of strings (see :class:`~palpate.core.automata.strings.Strings`).
    """
    return strings_of(read_text(Path(path), "strings.file"))


def strings_of(text: str) -> Strings:
    """Read strings from the text of a file; see :func:`read_strings`."""
    lines = {place: line.rstrip("\r") for place, line in enumerate(text.split("\n"), start=1)}
    told = _headers(lines)
    content = {place: line for place, line in lines.items() if line.strip() and not line.startswith(_COMMENT)}
    if _ACTIONS in told:
        return _pairs_of(content, told.get(_ALPHABET, ()), told[_ACTIONS])
    alphabet = told.get(_ALPHABET)
    if not any("\t" in line for line in content.values()):
        bodies = {place: line.strip() for place, line in content.items()}
        return Strings.of(_words(bodies, alphabet, labelled=False).values(), [], alphabet=alphabet)
    parted = {place: _parted(place, line) for place, line in content.items()}
    bodies = {place: body for place, (_, body) in parted.items()}
    labels = [label for label, _ in parted.values()]
    return Strings.of(_words(bodies, alphabet, labelled=True).values(), labels, alphabet=alphabet)


def _headers(lines: Mapping[int, str]) -> dict[str, tuple[str, ...]]:
    """Names of symbols and of actions, as far as the file tells them."""
    told: dict[str, tuple[str, ...]] = {}
    for place, line in lines.items():
        for header in (_ALPHABET, _ACTIONS):
            names = tuple(map(_name, line.removeprefix(header).split()))
            if line.startswith(header) and told.setdefault(header, names) != names:
                accepted = f"the same as above, {' '.join(told[header])}: one alphabet a file"
                raise ConfigurationError(f"strings.line[{place}]", line, accepted)
    return told


def _parted(place: int, line: str) -> tuple[bool, str]:
    """A line's label and its string."""
    label, _, body = line.partition("\t")
    if label.strip() not in _LABELS or "\t" in body:
        raise ConfigurationError(f"strings.line[{place}]", line, "1 or 0, a tab, and the string")
    return _LABELS[label.strip()], body.strip()


def _words(bodies: Mapping[int, str], alphabet: tuple[str, ...] | None, *, labelled: bool) -> dict[int, list[str]]:
    """Each line's symbols: words between blanks where there is a blank or a name of several letters, else letters."""
    apart = any(" " in body for body in bodies.values()) or any(len(name) > 1 for name in alphabet or ())
    words = {place: [_name(word) for word in body.split()] if apart else list(body) for place, body in bodies.items()}
    if apart and not labelled and alphabet is None:
        _require_plain(bodies, words)
    if alphabet is not None:
        _require_known(words, alphabet)
    return words


def _require_known(words: Mapping[int, list[str]], alphabet: tuple[str, ...]) -> None:
    for place, word in words.items():
        for name in word:
            if name not in alphabet:
                accepted = f"symbols of the alphabet {' '.join(alphabet)}"
                raise ConfigurationError(f"strings.line[{place}]", name, accepted)


def _require_plain(bodies: Mapping[int, str], words: Mapping[int, list[str]]) -> None:
    """Refuse what looks like labels, or like pairs of action and symbol, and is not marked as that."""
    if all(word[0] in _LABELS for word in words.values()):
        place = min(words)
        accepted = "a tab, not a blank, between label and string, or '# alphabet: 0 1' if it is no label"
        raise ConfigurationError(f"strings.line[{place}]", bodies[place], accepted)
    if _look_paired(words.values()):
        accepted = f"'{_ALPHABET} ...' and '{_ACTIONS} ...' above pairs of action and symbol, or else the alphabet"
        raise ConfigurationError("strings", brief(max(words.values(), key=len)), accepted)


def _look_paired(words: Collection[Sequence[str]]) -> bool:
    longer = any(len(word) > 1 for word in words)
    return longer and all([BETWEEN in name for name in word] == [False] + [True] * (len(word) - 1) for word in words)


def _pairs_of(content: dict[int, str], symbols: tuple[str, ...], actions: tuple[str, ...]) -> Strings:
    names = letters_of(symbols, actions)
    number = {name: place for place, name in enumerate(names)}
    last = {f"{action}{BETWEEN}{END}": place for place, action in enumerate(actions)}
    words, ends = [], []
    for place, line in content.items():
        word = list(map(_name, line.split()))
        ends.append(last[word.pop()] if word[-1] in last else None)
        for at, name in enumerate(word):
            if (number.get(name, -1) < len(symbols)) is not (at == 0) or name not in number:
                accepted = (
                    f"a symbol first, then ACTION{BETWEEN}SYMBOL each time, over {_ALPHABET[2:]} and {_ACTIONS[2:]}"
                )
                raise ConfigurationError(f"strings.line[{place}]", name, accepted)
        words.append(tuple(number[name] for name in word))
    return Strings(names, tuple(words), actions=actions, ends=tuple(ends))


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
    actions = [name.replace(" ", _BLANK) for name in strings.actions]
    between = " " if any(len(name) > 1 for name in names) else ""
    lines = [f"{_ALPHABET} {' '.join(names[: len(strings.names)])}"]
    lines += [f"{_ACTIONS} {' '.join(actions)}"] if actions else []
    for place, word in enumerate(strings.words):
        body = between.join(names[symbol] for symbol in word)
        if actions and (end := strings.ends[place]) is not None:
            body += f" {actions[end]}{BETWEEN}{END}"
        lines.append(f"{int(strings.labels[place])}\t{body}" if strings.labels else body)
    return "\n".join(lines) + "\n"


def write_strings(strings: Strings, path: str | os.PathLike[str]) -> None:
    """Write a file that :func:`read_strings` reads back as it was; an older one of the name is replaced.

    Raises:
        ConfigurationError: A symbol's name cannot be written.
        OutputError: The place cannot be written to.
    """
    write_whole(Path(path), text_of(strings))


def _name(word: str) -> str:
    return word.replace(_BLANK, " ")
