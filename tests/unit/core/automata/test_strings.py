import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata.strings import Strings
from palpate.core.errors import ConfigurationError


def test_the_empty_string_needs_a_label() -> None:
    with pytest.raises(ConfigurationError, match=r"strings\[1\].*at least one symbol"):
        Strings.of(["AB", ""])


@pytest.mark.parametrize(
    ("words", "labels", "alphabet", "said"),
    [
        ([], [], "AB", r"strings = \(\) is refused: at least one string"),
        (["AB", "AXB"], [], "AB", r"strings\[1\] = 'X' is refused: symbols of the alphabet A B"),
        (["AAA", "A"], [], "A", "two symbols or more"),
        (["AAA", "A"], [], None, "two symbols or more"),
        (["AAA", "A"], [], "AB", "strings = 'A A A' is refused: strings in which two different symbols occur"),
        (["", ""], [True, True], "AB", "strings = 'the empty string' is refused: strings in which two"),
        (["AB", "BA", "AB"], [True, True, False], None, "strings = 'A B' is refused: each string either accepted or"),
        (["AB", "BA"], [True], None, "true or false for each of 2"),
        (["AB"], [], "ABA", "different names"),
        (["AB"], [], ("A", "B", ""), "different names"),
    ],
)
def test_what_cannot_be_learned_from_is_refused_in_one_line(words, labels, alphabet, said) -> None:
    with pytest.raises(ConfigurationError, match=said) as caught:
        Strings.of(words, labels, alphabet=alphabet)
    assert "\n" not in str(caught.value)


def test_numbers_outside_the_alphabet_are_refused() -> None:
    for symbol in (-1, 2):
        with pytest.raises(ConfigurationError, match=r"strings\[0\].*symbols from 0 to 1"):
            Strings(("A", "B"), ((0, symbol),))


def test_long_strings_are_cut_in_messages() -> None:
    with pytest.raises(ConfigurationError, match=r"A A A A A A A A A A A A \.\.\."):
        Strings.of(["A" * 40], alphabet="AB")


words = st.lists(st.lists(st.sampled_from("ABC"), min_size=1, max_size=6).map("".join), min_size=2, max_size=40)


@given(words, st.floats(0.01, 0.99), st.integers(0, 1000))
def test_a_split_loses_nothing_and_is_repeatable(listed, share, seed) -> None:
    strings = Strings(("A", "B", "C"), tuple((0, 1, *map("ABC".index, word)) for word in listed))
    kept, held = strings.split(share, seed)
    assert sorted(kept.words + held.words) == sorted(strings.words)
    assert (kept, held) == strings.split(share, seed)
    assert kept.alphabet == held.alphabet == strings.alphabet
    assert abs(len(held.words) - share * len(strings.words)) <= 1.0


def test_a_split_keeps_labels_with_their_strings() -> None:
    strings = Strings.of([f"{n:04b}" for n in range(16)], [n % 3 == 0 for n in range(16)])
    for part in strings.split(0.25, 3):
        assert all(
            label == (int("".join(map(str, w)), 2) % 3 == 0) for w, label in zip(part.words, part.labels, strict=True)
        )
    assert len(strings.split(0.25, 3)[1].words) == 4


@pytest.mark.parametrize("share", [0.0, 1.0, -0.5])
def test_a_split_has_two_sides(share) -> None:
    with pytest.raises(ConfigurationError, match="above 0 and below 1"):
        Strings.of(["AB", "BA"]).split(share, 0)


def test_a_split_whose_parts_are_too_poor_is_refused_in_its_own_words() -> None:
    with pytest.raises(
        ConfigurationError, match=r"strings\.held_out = 0\.2 is refused: another share, or more strings"
    ):
        Strings.of(["AA", "BB"]).split(0.2, 0)
