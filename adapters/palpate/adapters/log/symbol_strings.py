"""Symbol strings from recorded trials, and from text files with one string of letters or words per line."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from palpate.adapters.files import read_text, write_whole
from palpate.adapters.log.find import find_logs
from palpate.adapters.log.json_text import json_in
from palpate.adapters.log.reader import read_log
from palpate.core.automata import Strings
from palpate.core.errors import ConfigurationError
from palpate.core.perception import perception_from_dict
from palpate.core.trial import Outcome

_LOG: Final = ".mcap"
_FIELD: Final = "strings"
_COMMENT: Final = "#"
_ALPHABET: Final = "# alphabet:"
_BLANK: Final = "~"
_LABELS: Final = {"1": True, "0": False}


def strings_from(paths: Sequence[str]) -> Strings:
    """Read a text file of strings, or extract strings from logs of insertion trials.

    From logs, each trial that ended in the hole yields the symbols at its decisions, in order. The alphabet is the one
    used by the trials' perception, including symbols that did not occur.

    Raises:
        ConfigurationError: There are no strings, or the trials have different symbols.
        LogError: A name matches no file, or a log cannot be read.
    """
    if not paths:
        raise ConfigurationError(_FIELD, (), "a file of strings, or logs of trials")
    files = find_logs(paths)
    logs = [file for file in files if file.suffix == _LOG]
    if not logs and len(files) == 1:
        return read_strings(files[0])
    if len(logs) < len(files):
        other = next(file for file in files if file.suffix != _LOG)
        raise ConfigurationError(_FIELD, str(other), "either one text file, or logs (.mcap) and folders of logs alone")
    return _strings_of_logs(logs)


def _strings_of_logs(files: Sequence[Path]) -> Strings:
    alphabet: tuple[str, ...] | None = None
    words: list[tuple[str, ...]] = []
    for file in files:
        log = read_log(file)
        symbols = perception_from_dict(json_in(log, "start.perception_json", log.start.perception_json)).symbols
        if alphabet is not None and symbols != alphabet:
            raise ConfigurationError(_FIELD, str(file), f"logs of trials with the same symbols: {', '.join(alphabet)}")
        alphabet = symbols
        word = tuple(decision.symbol for decision in log.decisions if not decision.counterfactual)
        if word and log.end is not None and log.end.outcome == Outcome.INSERTED.value:
            words.append(word)
    if not words:
        accepted = f"logs of trials that chose actions and ended in the hole; none of {len(files)} did"
        raise ConfigurationError(_FIELD, str(files[0]), accepted)
    return Strings.of(words, alphabet=alphabet)


def read_strings(path: str | os.PathLike[str]) -> Strings:
    """Read a file of strings.

    Raises:
        ConfigurationError: The file does not exist, a line cannot be read, a symbol is not in the file's alphabet, or
            the strings are not usable (see :class:`~palpate.core.automata.strings.Strings`).
    """
    return strings_of(read_text(Path(path), "strings.file"))


def strings_of(text: str) -> Strings:
    """Read strings from a file's text; see :func:`read_strings`."""
    lines = {place: line.rstrip("\r") for place, line in enumerate(text.split("\n"), start=1)}
    alphabet = _alphabet_of(lines)
    content = {place: line for place, line in lines.items() if line.strip() and not line.startswith(_COMMENT)}
    if not any("\t" in line for line in content.values()):
        bodies = {place: line.strip() for place, line in content.items()}
        return Strings.of(_words(bodies, alphabet, labelled=False).values(), [], alphabet=alphabet)
    parted = {place: _parted(place, line) for place, line in content.items()}
    bodies = {place: body for place, (_, body) in parted.items()}
    labels = [label for label, _ in parted.values()]
    return Strings.of(_words(bodies, alphabet, labelled=True).values(), labels, alphabet=alphabet)


def _alphabet_of(lines: Mapping[int, str]) -> tuple[str, ...] | None:
    """Return the names of the symbols, if the file lists them."""
    found: tuple[str, ...] | None = None
    for place, line in lines.items():
        if line.startswith(_ALPHABET):
            names = tuple(map(_name, line.removeprefix(_ALPHABET).split()))
            if found is not None and found != names:
                accepted = f"the same as above, {' '.join(found)}: one alphabet per file"
                raise ConfigurationError(f"strings.line[{place}]", line, accepted)
            found = names
    return found


def _parted(place: int, line: str) -> tuple[bool, str]:
    """Return the label and the string on a line."""
    label, _, body = line.partition("\t")
    if label.strip() not in _LABELS or "\t" in body:
        raise ConfigurationError(f"strings.line[{place}]", line, "1 or 0, a tab, and the string")
    return _LABELS[label.strip()], body.strip()


def _words(bodies: Mapping[int, str], alphabet: tuple[str, ...] | None, *, labelled: bool) -> dict[int, list[str]]:
    """Return the symbols on each line: words if there is a space or a multi-letter name; otherwise letters."""
    apart = any(" " in body for body in bodies.values()) or any(len(name) > 1 for name in alphabet or ())
    words = {place: [_name(word) for word in body.split()] if apart else list(body) for place, body in bodies.items()}
    if apart and not labelled and alphabet is None and all(word[0] in _LABELS for word in words.values()):
        # The first words look like labels but are not separated by a tab.
        place = min(words)
        accepted = "a tab, not a blank, between label and string, or '# alphabet: 0 1' if it is no label"
        raise ConfigurationError(f"strings.line[{place}]", bodies[place], accepted)
    for place, word in words.items():
        if alphabet is not None and (unknown := [name for name in word if name not in alphabet]):
            accepted = f"symbols of the alphabet {' '.join(alphabet)}"
            raise ConfigurationError(f"strings.line[{place}]", unknown[0], accepted)
    return words


def text_of(strings: Strings) -> str:
    """Format strings as text for a file.

    Raises:
        ConfigurationError: A symbol's name cannot be written: it contains ``#``, ``~``, or whitespace other than single
            spaces.
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
    """Write strings to a file for :func:`read_strings`, replacing any existing file.

    Raises:
        ConfigurationError: A symbol's name cannot be written.
        OutputError: The file cannot be written.
    """
    write_whole(Path(path), text_of(strings))


def _name(word: str) -> str:
    return word.replace(_BLANK, " ")
