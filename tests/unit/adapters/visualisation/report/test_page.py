import pytest

from palpate.adapters.visualisation.report.page import share


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0 %"), (1.0, "100 %"), (0.5, "50 %"), (0.9999, "> 99 %"), (0.0001, "< 1 %"), (0.994, "99 %")],
)
def test_a_share_is_all_or_nothing_only_if_it_is(value: float, text: str) -> None:
    assert share(value) == text
