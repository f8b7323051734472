"""The corpus of the fuzz harness, through the whole driver, and how each input must end."""

from pathlib import Path

import pytest

from benchmarks.fuzz_cia402 import CORPUS, once

FAULTS = {"astray", "boot", "emergency", "fault_state", "mute", "stopped"}


@pytest.mark.parametrize("path", sorted(CORPUS.iterdir()), ids=lambda path: path.name)
def test_inputs_of_the_corpus(path: Path) -> None:
    data = path.read_bytes()
    assert len(data) < 300
    assert once(data) == ("faulted" if path.name in FAULTS else "enabled")


def test_the_corpus_is_there() -> None:
    assert 10 <= len(list(CORPUS.iterdir())) <= 40
    assert once(b"") == "enabled"
