"""``palpate view``, with a window that counts, and without a display."""

from typing import Any, Self

import pytest

from palpate.adapters.cli import view
from palpate.adapters.visualisation import viewer
from tests.command_line import CommandLine


@pytest.mark.parametrize(
    ("words", "named", "accepted"),
    [
        ("", "policy = ''", "omniscient, torque"),
        ("--policy magic", "policy = 'magic'", "omniscient, torque"),
        ("--policy torque --trials 0", "trials = 0", "from 1"),
        ("--policy torque --speed 0", "speed = 0.0", "from 0.01"),
        ("--policy torque", "there is no display", "palpate render"),
    ],
)
def test_refused_in_one_line(
    palpate: CommandLine, monkeypatch: pytest.MonkeyPatch, words: str, named: str, accepted: str
) -> None:
    for name in viewer.DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    palpate.refuses(f"view {words}", named, accepted)


class Window:
    """Counts what it is given to show, and is closed after some of it."""

    def __init__(self, patience: int) -> None:
        self.shown, self.patience = 0, patience

    def sync(self) -> None:
        self.shown += 1

    def is_running(self) -> bool:
        return self.shown < self.patience

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        return


@pytest.mark.parametrize(("patience", "trials"), [(100_000, 2), (100, 0)])
def test_trials_are_shown_until_they_are_done_or_the_window_is_closed(
    palpate: CommandLine, monkeypatch: pytest.MonkeyPatch, patience: int, trials: int
) -> None:
    window, shown = Window(patience), list[Any]()

    def opened(model: Any, data: Any, target_m: tuple[float, float, float]) -> Window:
        assert target_m == pytest.approx((0.4, 0.0, 0.02))
        shown.append(data)
        return window

    monkeypatch.setattr(view, "open_viewer", opened)
    monkeypatch.setattr(view, "require_display", lambda: None)
    # The grip of this seed is not the one that the window is opened with, and yet the peg is seen going in.
    grip = ("--scenario", "blind-tilt-2", "--seed", 3)
    printed = palpate.succeed("view", "--policy", "omniscient", "--trials", 2, "--speed", 100, *grip).splitlines()
    assert [line.split(",")[0] for line in printed] == [f"trial {k}: inserted" for k in range(trials)]
    assert window.shown == patience or (window.shown > 400 and shown[0].site("tip").xpos[2] < 0.0105)
