"""The inputs that fuzzing has kept go through every target of the fuzzer."""

import pytest

from benchmarks.fuzz_nmc import CORPUS, once

FILES = sorted(CORPUS.iterdir())


@pytest.mark.parametrize("path", FILES, ids=[path.name for path in FILES])
def test_corpus(path):
    once(path.read_bytes())


def test_there_is_a_corpus():
    assert len(FILES) >= 16
