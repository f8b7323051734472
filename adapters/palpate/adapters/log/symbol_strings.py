"""Symbol strings from text files, or from the symbols of recorded insertion trials."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from palpate.adapters.files import read_strings
from palpate.adapters.log.find import find_logs
from palpate.adapters.log.json_text import json_in
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.core.automata import Strings
from palpate.core.errors import ConfigurationError
from palpate.core.perception import perception_from_dict
from palpate.core.trial import Outcome

_LOG: Final = ".mcap"
_FIELD: Final = "strings"


def strings_from(paths: Sequence[str]) -> Strings:
    """Read one text file of strings, or logs of insertion trials.

    From logs, each trial that ended in the hole gives the symbols at its decisions, in order. The alphabet is that of
    the trials' perception, including symbols that did not occur.

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
        symbols = _alphabet(log)
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


def _alphabet(log: TrialLog) -> tuple[str, ...]:
    return perception_from_dict(json_in(log, "start.perception_json", log.start.perception_json)).symbols
