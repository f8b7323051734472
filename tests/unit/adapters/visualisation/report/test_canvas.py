"""Pictures have equal bytes, whatever the user's own settings of matplotlib are."""

import matplotlib as mpl
import pytest

from palpate.adapters.visualisation.report.canvas import drawn, file_name


def picture() -> bytes:
    with drawn(2.0) as canvas:
        canvas.figure.add_subplot().plot([1, 2, 3], label="$x_1$")
        canvas.figure.legend()
    return canvas.content


def test_equal_bytes() -> None:
    first = picture()
    with mpl.rc_context({"lines.linewidth": 7.0, "font.size": 20.0, "savefig.dpi": 31}):
        assert picture() == first


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("task.step_mm", "task.step-mm"),
        ("Position regions", "position-regions"),
        ("../../etc", "etc"),
        ("é<>", "x"),
        ("a" * 99, "a" * 60),
    ],
)
def test_file_names(text: str, name: str) -> None:
    assert file_name(text) == name
