"""``palpate run --view``, with a window that counts, and without a display."""

import threading
from pathlib import Path
from typing import Any

import mujoco.viewer
import pytest

from palpate.adapters.visualisation import viewer
from tests.command_line import finished_trials

VIEW = ("run", "--policy", "oracle", "--recording.no-enabled", "--out", "out", "--view")


class Window:
    """Counts what it shows, and is closed after some of it."""

    def __init__(self, timeout_scale):
        self.shown, self.timeout_scale = 0, timeout_scale
        self.cam = mujoco.MjvCamera()

    def sync(self):
        self.shown += 1

    def is_running(self):
        return self.shown < self.timeout_scale

    def lock(self):
        return threading.Lock()

    def close(self):
        """Nothing was opened."""


@pytest.mark.parametrize(("timeout_scale", "trials"), [(100_000, 1), (100, 0)])
def test_trials_are_shown_until_they_are_done_or_the_window_is_closed(palpate, monkeypatch, timeout_scale, trials):
    window, shown = Window(timeout_scale), list[Any]()

    def launch(model, data, **others):
        shown.append(data)
        return window

    monkeypatch.setenv("DISPLAY", ":9")
    monkeypatch.setattr(mujoco.viewer, "launch_passive", launch)
    # The grip of this seed is not the one that the window is opened with, and yet the peg is seen going in.
    grip = ("--scenario", "blind-tilt-2", "--seed", 3)
    done = palpate(*VIEW, "--trials", 1, *grip)
    assert done.code == (0 if trials else 130)
    assert window.cam.distance == pytest.approx(0.4)
    assert window.shown == timeout_scale or (window.shown > 200 and shown[0].site("tip").xpos[2] < 0.0105)
    if trials:
        assert finished_trials(Path("out")) == trials


def test_without_a_display_it_is_refused(palpate, monkeypatch):
    for name in viewer.DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    assert "there is no display" in palpate.refusal(*VIEW)
