import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.files.strings import read_strings, strings_of, text_of, write_strings
from palpate.core.automata.strings import Strings
from palpate.core.errors import ConfigurationError


def test_letters_together() -> None:
    strings = strings_of("# walks of a Monday\nABBA\n\n  CAB \nB\n")
    assert strings == Strings.of(["ABBA", "CAB", "B"])


def test_one_blank_makes_every_line_a_list_of_names() -> None:
    assert strings_of("NE N SW\nSW\nN N\n") == Strings.of([("NE", "N", "SW"), ("SW",), ("N", "N")])


def test_a_tab_makes_labels() -> None:
    text = "1\t0101\n0\t1\n1\t\n1\n"
    assert strings_of(text) == Strings.of(["0101", "1", "", ""], [True, False, True, True])
    assert strings_of("1\tx- y0\n0\ty0\n") == Strings.of([("x-", "y0"), ("y0",)], [True, False])


def test_lines_may_end_as_elsewhere() -> None:
    assert strings_of("1\tAB\r\n0\tBA\r\n") == Strings.of(["AB", "BA"], [True, False])


def test_the_alphabet_may_be_named_and_decides_on_names() -> None:
    assert strings_of("# alphabet: B A C\nAB\n").alphabet == ("B", "A", "C")
    assert strings_of("# alphabet: up down\nup\ndown\n") == Strings.of([("up",), ("down",)], alphabet=("up", "down"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "at least one string"),
        ("# alphabet: A B\n", "at least one string"),
        ("# alphabet: A B\nAB\n\nAC\n", r"strings\.line\[4\] = 'C' is refused: symbols of the alphabet A B"),
        (
            "# alphabet: A B\nAB\n# alphabet: A C\nA\n",
            r"strings\.line\[3\].*the same as above, A B: one alphabet a file",
        ),
        ("1\tAB\n2\tBA\n", r"strings\.line\[2\].*1 or 0, a tab, and the string"),
        ("1\tAB\nBA\n", r"strings\.line\[2\].*1 or 0, a tab"),
        ("1\tAB\tBA\n", r"strings\.line\[1\].*1 or 0, a tab"),
        ("1 ABBA\n0 AB\n", r"strings\.line\[1\].*a tab, not a blank"),
        ("1\tAB\n0\tAB\n", "either accepted or rejected"),
        ("AAA\nA\n", "two symbols or more"),
    ],
)
def test_bad_files_are_refused_with_their_line(text, said) -> None:
    with pytest.raises(ConfigurationError, match=said):
        strings_of(text)


def test_digits_with_blanks_are_symbols_if_the_alphabet_says_so() -> None:
    assert strings_of("# alphabet: 0 1\n1 0\n0 1 1\n") == Strings.of(["10", "011"])


letters = st.sampled_from([("A", "B", "C"), ("0", "1"), ("x- y0", "x0 y+", "tx-"), ("é", "ß", "long name")])


@given(letters, st.data(), st.booleans())
def test_what_is_written_is_read_as_it_was(alphabet, data, labelled) -> None:
    symbols = st.integers(0, len(alphabet) - 1)
    least = 0 if labelled else 1
    words = data.draw(st.lists(st.lists(symbols, min_size=least, max_size=5).map(tuple), max_size=8, unique=True))
    words = [(0, 1, 1, 0, 1, 0, 0), *words]
    labels = data.draw(st.lists(st.booleans(), min_size=len(words), max_size=len(words))) if labelled else []
    strings = Strings(alphabet, tuple(words), tuple(labels))
    assert strings_of(text_of(strings)) == strings


def test_files(tmp_path) -> None:
    strings = Strings.of(["01", "", "1"], [True, False, True])
    path = tmp_path / "strings.txt"
    write_strings(strings, path)
    assert path.read_bytes() == b"# alphabet: 0 1\n1\t01\n0\t\n1\t1\n"
    assert read_strings(path) == strings
    with pytest.raises(ConfigurationError, match=r"strings\.file.*a readable text file \(No such file"):
        read_strings(tmp_path / "none")
    path.write_bytes(b"AB\n\xff")
    with pytest.raises(ConfigurationError, match="a text file in UTF-8; its byte 3 is not"):
        read_strings(path)
    with pytest.raises(FileNotFoundError):
        write_strings(strings, tmp_path / "no" / "place")


@pytest.mark.parametrize("name", ["#", "a~b", " a", "a  b", "a\tb", "a\nb"])
def test_names_that_would_be_misread_are_not_written(name) -> None:
    with pytest.raises(ConfigurationError, match="names without"):
        text_of(Strings.of([(name, "B")]))
