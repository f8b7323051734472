"""Files and folders that are whole or not there, and files of strings, examples, policies and automata."""

import os
import stat
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.experiments import load_automaton, load_examples, load_policy
from palpate.adapters.files import new_file, new_folder, require_free_folder, whole_text, write_whole
from palpate.adapters.log.symbol_strings import read_strings, strings_of, text_of, write_strings
from palpate.core.automata.strings import Strings
from palpate.core.errors import ConfigurationError, LogError, OutputError
from tests.unit.core.policy.bench import EIGHT, refuse


def test_pipe_or_device_that_ends_is_read_whole_without_its_byte_order_mark():
    end, begin = os.pipe()
    os.write(begin, b"\xef\xbb\xbfa\r\nb")
    os.close(begin)
    assert whole_text(f"/dev/fd/{end}").read() == "a\nb"
    os.close(end)
    assert whole_text("/dev/null").read() == ""


@pytest.mark.parametrize("durable", [True, False])
def test_file_is_replaced_whole(tmp_path, monkeypatch, durable):
    synced = []
    fsync = os.fsync

    def noted(descriptor):
        synced.append(stat.S_ISDIR(os.fstat(descriptor).st_mode))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noted)
    path = tmp_path / "a.txt"
    write_whole(path, b"old and longer", durable=durable)
    write_whole(path, "n\u00fc\n", durable=durable)
    assert path.read_bytes() == b"n\xc3\xbc\n"
    assert list(tmp_path.iterdir()) == [path]
    # First the file's content, then, once it has its name, the folder's list of names.
    assert synced == ([False, True] * 2 if durable else [])


@pytest.mark.parametrize("fails", ["fsync", "replace"])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, fails, error):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(*_):
        raise error

    monkeypatch.setattr(f"os.{fails}", full)
    with pytest.raises((OSError, KeyboardInterrupt), match=r"No space left.*a\.txt" if error.args else None):
        write_whole(path, "new")
    monkeypatch.undo()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("fails", [False, True])
def test_file_is_there_only_when_it_is_complete(tmp_path, fails):
    path = tmp_path / "a.png"
    with suppress(LogError), new_file(path) as passing:
        passing.write_bytes(b"half")
        assert not path.exists()
        if fails:
            raise LogError("x", "", "bad", "no")
    assert [(each, each.read_bytes()) for each in tmp_path.iterdir()] == ([] if fails else [(path, b"half")])


def test_file_that_came_in_between_is_not_overwritten(tmp_path):
    path = tmp_path / "a.png"
    with pytest.raises(OutputError, match="never overwritten"), new_file(path):
        path.write_bytes(b"theirs")
    assert path.read_bytes() == b"theirs"
    assert list(tmp_path.iterdir()) == [path]


def test_link_that_leads_nowhere_is_in_the_way(tmp_path):
    link = tmp_path / "a.png"
    link.symlink_to(tmp_path / "nowhere")
    with pytest.raises(OutputError), new_file(link):
        pass
    with pytest.raises(OutputError), new_folder(link):
        pass
    assert link.is_symlink()


@pytest.mark.parametrize("there", [False, True])
def test_folder_takes_the_place_of_nothing_or_of_an_empty_one(tmp_path, there):
    path = tmp_path / "above" / "out"
    if there:
        path.mkdir(parents=True)
    with new_folder(path) as passing:
        (passing / "a.csv").write_text("1\n")
        assert not (path / "a.csv").exists()
    assert (path / "a.csv").read_text() == "1\n"
    assert list(path.parent.iterdir()) == [path]


def test_after_an_error_no_folder_stays_and_none_above_it(tmp_path):
    with pytest.raises(KeyboardInterrupt), new_folder(tmp_path / "x" / "y" / "out"):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_folder_that_holds_something_is_refused(tmp_path):
    (tmp_path / "a").write_text("mine")
    with pytest.raises(OutputError, match="holds something"), new_folder(tmp_path):
        pass
    with pytest.raises(OutputError, match="is no folder"), new_folder(tmp_path / "a"):
        pass
    with pytest.raises(NotADirectoryError, match="a/b"), new_folder(tmp_path / "a" / "b"):
        pass
    assert (tmp_path / "a").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 1


def test_whether_a_folder_can_be_made_is_known_beforehand(tmp_path):
    for place in (tmp_path, tmp_path / "new", tmp_path / "above" / "new"):
        require_free_folder(place)
    for place in (tmp_path / ("x" * 300), Path("/proc/new")):
        with pytest.raises(OSError, match=place.name):
            require_free_folder(place)
    assert list(tmp_path.iterdir()) == []


def test_one_blank_makes_every_line_a_list_of_names():
    assert strings_of("NE N SW\nSW\nN N\n") == Strings.of([("NE", "N", "SW"), ("SW",), ("N", "N")])


def test_tab_makes_labels():
    text = "1\t0101\n0\t1\n1\t\n1\n"
    assert strings_of(text) == Strings.of(["0101", "1", "", ""], [True, False, True, True])
    assert strings_of("1\tx- y0\n0\ty0\n") == Strings.of([("x-", "y0"), ("y0",)], [True, False])


def test_alphabet_may_be_named_and_decides_on_names():
    assert strings_of("# alphabet: B A C\nAB\n").alphabet == ("B", "A", "C")
    assert strings_of("# alphabet: up down\nup\ndown\n") == Strings.of([("up",), ("down",)], alphabet=("up", "down"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("# alphabet: A B\nAB\n\nAC\n", r"strings\.line\[4\] must be symbols of the alphabet A B"),
        (
            "# alphabet: A B\nAB\n# alphabet: A C\nA\n",
            r"strings\.line\[3\].*the same as above, A B: one alphabet per file",
        ),
        ("1\tAB\n2\tBA\n", r"strings\.line\[2\].*1 or 0, a tab, and the string"),
        ("1 ABBA\n0 AB\n", r"strings\.line\[1\].*a tab, not a blank"),
    ],
)
def test_bad_files_are_refused_with_their_line(text, said):
    with pytest.raises(ConfigurationError, match=said):
        strings_of(text)


letters = st.sampled_from([("A", "B", "C"), ("0", "1"), ("x- y0", "x0 y+", "tx-"), ("é", "ß", "long name")])


@given(letters, st.data(), st.booleans())
def test_written_strings_read_back(alphabet, data, labelled):
    symbols = st.integers(0, len(alphabet) - 1)
    least = 0 if labelled else 1
    words = data.draw(st.lists(st.lists(symbols, min_size=least, max_size=5).map(tuple), max_size=8, unique=True))
    words = [(0, 1, 1, 0, 1, 0, 0), *words]
    labels = data.draw(st.lists(st.booleans(), min_size=len(words), max_size=len(words))) if labelled else []
    strings = Strings(alphabet, tuple(words), tuple(labels))
    assert strings_of(text_of(strings)) == strings


def test_files(tmp_path):
    strings = Strings.of(["01", "", "1"], [True, False, True])
    path = tmp_path / "strings.txt"
    write_strings(strings, path)
    assert path.read_bytes() == b"# alphabet: 0 1\n1\t01\n0\t\n1\t1\n"
    assert read_strings(path) == strings
    with pytest.raises(FileNotFoundError):
        write_strings(strings, tmp_path / "no" / "place")


@pytest.mark.parametrize("name", ["#", "a~b", " a", "a  b", "a\tb", "a\nb"])
def test_names_that_would_be_misread_are_not_written(name):
    with pytest.raises(ConfigurationError, match="names without"):
        text_of(Strings.of([(name, "B")]))


STATES = ("a", "b", "c")


@pytest.mark.parametrize("load", [load_automaton, load_policy])
def test_refusal_names_the_file(tmp_path, load):
    path = tmp_path / "sample.json"
    path.write_text('{"schema": "s"}')
    with pytest.raises(ConfigurationError) as refused:
        load(path)
    assert refused.value.field == f"{path}: schema"


def test_file_of_decisions_is_read_and_other_columns_are_ignored(tmp_path):
    path = tmp_path / "decisions.csv"
    path.write_text('trial,state,q,action\r\n0,a,"-1.0,2",+x\r\n0,b,,-y\r\n', encoding="utf-8-sig")
    assert load_examples(path, STATES, EIGHT) == (("a", "+x"), ("b", "-y"))
    assert load_examples(str(path)) == load_examples(path)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (b"trial,action\n0,+x\n", "1"),
        (b"state,action\na,+x\nb\n", "3"),
        (b"state,action\na,+x\nd,+x\n", "3"),
        (b"state,action\na,+x\n\nb,east\n", "4"),
    ],
)
def test_errors_name_the_file_and_the_line(tmp_path, text, line):
    path = tmp_path / "decisions.csv"
    path.write_bytes(text)
    error = refuse(f"policy.examples: {path}:{line}", load_examples, path, STATES, EIGHT)
    assert "\n" not in str(error)
