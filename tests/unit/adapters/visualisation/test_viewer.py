"""The clock that shows trials, with a viewer that only counts."""

import sys
import threading
import time
from contextlib import nullcontext
from types import SimpleNamespace

import mujoco
import pytest

from palpate.adapters.visualisation import ShownClock, WindowClosedError, open_viewer, require_display
from palpate.adapters.visualisation import viewer as live
from palpate.core.errors import UsageError
from palpate.core.ports.devices import Clock

MS = 1_000_000


class Time(Clock):
    """A clock that only moves when somebody sleeps, or when it is told to."""

    def __init__(self, now_ns: int = 0) -> None:
        self.now, self.slept = now_ns, list[int]()

    def now_ns(self) -> int:
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        self.slept.append(deadline_ns)
        self.now = max(self.now, deadline_ns)


class Window:
    def __init__(self) -> None:
        self.shown, self.open = 0, True

    def sync(self) -> None:
        self.shown += 1

    def is_running(self) -> bool:
        return self.open


def test_every_tick_is_shown_at_its_time() -> None:
    simulated, real, window = Time(500 * MS), Time(), Window()
    clock = ShownClock(simulated, window, 1.0, real)
    for k in range(1, 4):
        clock.sleep_until(500 * MS + 7 * k * MS)
        assert clock.now_ns() == simulated.now == 500 * MS + 7 * k * MS
    assert real.slept == [7 * MS, 14 * MS, 21 * MS]
    assert window.shown == 3


@pytest.mark.parametrize(("speed", "takes_ms"), [(0.5, 14), (2.0, 3.5)])
def test_speed_is_trial_time_per_time(speed: float, takes_ms: float) -> None:
    real = Time()
    ShownClock(Time(), Window(), speed, real).sleep_until(7 * MS)
    assert real.slept == [takes_ms * MS]


def test_what_is_a_little_late_catches_up_and_what_is_very_late_begins_anew() -> None:
    simulated, real, window = Time(), Time(), Window()
    clock = ShownClock(simulated, window, 1.0, real)
    real.now = 20 * MS
    clock.sleep_until(7 * MS)
    assert real.slept == []
    clock.sleep_until(30 * MS)
    assert real.slept == [30 * MS]
    # A second of pause between trials: the next tick is due one period later, not in the past.
    real.now += 1000 * MS
    clock.sleep_until(37 * MS)
    clock.sleep_until(44 * MS)
    assert real.slept[1:] == [1037 * MS]
    assert window.shown == 4


def test_closing_the_window_ends_it() -> None:
    window = Window()
    clock = ShownClock(Time(), window, 1.0, Time())
    window.open = False
    with pytest.raises(WindowClosedError):
        clock.sleep_until(7 * MS)
    assert window.shown == 0


def test_without_a_display_it_is_said_what_to_do_instead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live.sys, "platform", "linux")
    for name in live.DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(UsageError, match=r"there is no display .* palpate render"):
        require_display()


def test_a_display_that_nobody_serves_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":987")
    with pytest.raises(UsageError, match="no window can be opened"):
        require_display()


def test_the_window_is_gone_before_the_model_may_go(monkeypatch: pytest.MonkeyPatch) -> None:
    closing, gone = threading.Event(), threading.Event()

    def draw() -> None:
        closing.wait(10.0)
        # A window takes a while to go; its thread reads the model until then.
        time.sleep(0.05)
        gone.set()

    class Passive(Window):
        cam = SimpleNamespace(lookat=[0.0] * 3)

        def lock(self) -> nullcontext[None]:
            return nullcontext()

        def close(self) -> None:
            closing.set()

    def launch(model: object, data: object, **options: object) -> Passive:
        threading.Thread(target=draw).start()
        return Passive()

    monkeypatch.setattr(live, "require_display", lambda: None)
    monkeypatch.setitem(sys.modules, "mujoco.viewer", SimpleNamespace(launch_passive=launch))
    monkeypatch.setattr(mujoco, "viewer", sys.modules["mujoco.viewer"], raising=False)
    with open_viewer(None, None, (0.4, 0.0, 0.02)) as window:
        assert window.cam.lookat == [0.4, 0.0, 0.02]  # type: ignore[attr-defined]
        assert not closing.is_set()
    assert gone.is_set()
