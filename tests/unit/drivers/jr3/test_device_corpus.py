"""The corpus of the fuzz harness, through the codecs, and what each input must be."""

from pathlib import Path

import pytest

from benchmarks.fuzz_jr3 import CODECS
from benchmarks.fuzzing import CORPORA

INPUTS = [(codec, path) for codec in CODECS for path in sorted((CORPORA / f"jr3_{codec}").iterdir())]
SILENT = {"heartbeat", "orphans", "kinds", "other_node", "host", "short", "bad_state", "echo", "noise"}


@pytest.mark.parametrize(("codec", "path"), INPUTS, ids=lambda value: getattr(value, "name", value))
def test_inputs_of_the_corpus(codec: str, path: Path) -> None:
    data = path.read_bytes()
    assert len(data) < 300
    heard = CODECS[codec](data)
    if path.name in SILENT:
        assert heard == []
    else:
        assert heard


@pytest.mark.parametrize("codec", CODECS)
def test_the_corpus_is_there(codec: str) -> None:
    assert 10 <= sum(name == codec for name, _ in INPUTS) <= 40
    assert CODECS[codec](b"") == []
