import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.examples import ExamplesPolicy, load_examples
from tests.unit.core.policy.bench import EIGHT, observation, refuse

NAMES = [action.name for action in EIGHT]
STATES = ("a", "b", "c")


def test_the_majority_decides_and_ties_go_to_the_first_action():
    shown = [("a", "-y"), ("a", "+y"), ("a", "-y"), ("b", "-x"), ("b", "+x")]
    policy = ExamplesPolicy(STATES, EIGHT, shown)
    assert [policy.assigned(state) for state in range(3)] == [NAMES.index("-y"), NAMES.index("+x"), None]
    assert policy.choose(observation(0)).source == "examples"


@pytest.mark.parametrize("pair", [("d", "+x"), ("a", "east")])
def test_unknown_names_are_refused(pair):
    refuse("policy.examples", ExamplesPolicy, STATES, EIGHT, [pair])


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
