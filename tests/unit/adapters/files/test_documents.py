from pathlib import Path

import pytest

from palpate.adapters.files import load_automaton, load_examples, load_policy
from palpate.core.errors import ConfigurationError
from tests.unit.core.policy.bench import EIGHT, refuse

STATES = ("a", "b", "c")


@pytest.mark.parametrize("load", [load_automaton, load_policy])
def test_a_refusal_names_the_file(tmp_path: Path, load):
    path = tmp_path / "sample.json"
    path.write_text('{"schema": "s"}')
    with pytest.raises(ConfigurationError) as refused:
        load(path)
    assert refused.value.field == f"{path}: schema"
    for bad in (tmp_path, tmp_path / "none.json"):
        with pytest.raises(ConfigurationError, match="a readable file in UTF-8"):
            load(bad)


def test_a_file_of_decisions_is_read_and_other_columns_are_ignored(tmp_path):
    path = tmp_path / "decisions.csv"
    path.write_text('trial,state,q,action\r\n0,a,"-1.0,2",+x\r\n0,b,,-y\r\n', encoding="utf-8-sig")
    assert load_examples(path, STATES, EIGHT) == (("a", "+x"), ("b", "-y"))
    assert load_examples(str(path)) == load_examples(path)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (b"", "1"),
        (b"trial,action\n0,+x\n", "1"),
        (b"state,state,action\na,b,+x\n", "1"),
        (b"state,action\na,+x\nb\n", "3"),
        (b"state,action\na,+x\n,+x\n", "3"),
        (b"state,action\na,+x\nd,+x\n", "3"),
        (b"state,action\na,+x\n\nb,east\n", "4"),
        (b'state,action\na,"+x\n', "2"),
    ],
)
def test_errors_name_the_file_and_the_line(tmp_path, text, line):
    path = tmp_path / "decisions.csv"
    path.write_bytes(text)
    error = refuse(f"policy.examples: {path}:{line}", load_examples, path, STATES, EIGHT)
    assert "\n" not in str(error)


@pytest.mark.parametrize("text", [b"state,action\n", b"state,action\n\xff,+x\n"])
def test_errors_of_the_whole_file_name_it(tmp_path, text):
    path = tmp_path / "decisions.csv"
    path.write_bytes(text)
    with pytest.raises(ConfigurationError, match=r"decisions\.csv"):
        load_examples(path)
