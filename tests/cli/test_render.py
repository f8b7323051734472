"""``palpate render`` on recorded trials and on what is none, ``palpate view`` without a display."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any, Self

import av
import pytest
from PIL import Image

from palpate.adapters.cli.main import main
from palpate.adapters.mujoco import graphics
from palpate.adapters.visualisation import viewer as live
from tests.integration.command_line import refused_here, succeed
from tests.unit.adapters.log.made_logs import start, tick, write_log
from tests.unit.adapters.visualisation.film.trials import INSERTION, require_graphics

SMALL = ("--size", "200x150")


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sound log, and all kinds of files that are none."""
    sound = INSERTION.read_bytes()
    contents = {
        "sound.mcap": sound,
        "torn.mcap": sound[: len(sound) // 2],
        "empty.mcap": b"",
        "text.mcap": b"tick,force\n",
        "there.png": b"a picture of mine",
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "folder.mcap").mkdir()
    (tmp_path / "folder.gif").mkdir()
    write_log(tmp_path / "seven.mcap", [tick(0)], begin=start(tip_rotation=(0.0,) * 7))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def rendered(words: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Render in this process, which must go well; returns what was printed."""
    assert main(["render", *words.split()]) == 0
    return capsys.readouterr().out


def test_films_and_sheets_in_every_format(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    require_graphics()
    seconds = ("--begin-s", 1.0, "--end-s", 1.5)
    printed = succeed("render", "sound.mcap", "--to", "a.mp4", *SMALL, *seconds, cwd=desk)
    assert "14 pictures of 1.00 to 1.50 s of the trial in a.mp4" in printed
    with av.open(str(desk / "a.mp4")) as film:
        stream = film.streams.video[0]
        assert (stream.width, stream.height, float(stream.average_rate or 0)) == (200, 150, 25.0)
        # A second of rest follows.
        assert sum(1 for _ in film.decode(stream)) == 14 + 25
    rendered("sound.mcap --to a.GIF --size 200x150 --begin-s 1 --end-s 1.5 --speed 0.5 --camera arm", capsys)
    with Image.open(desk / "a.GIF") as film:
        assert (film.format, film.size, film.n_frames) == ("GIF", (200, 150), 14)
    assert "4 pictures of 0.53 to 2.11 s" in rendered("sound.mcap --to a.png --size 640x520 --pictures 4", capsys)
    with Image.open(desk / "a.png") as sheet:
        assert (sheet.format, sheet.size) == ("PNG", (640, 520))
        assert len(sheet.convert("RGB").getcolors(1 << 20) or []) > 500


def test_equal_logs_give_equal_bytes_and_the_log_stays_as_it_is(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    require_graphics()
    for name in ("a.png", "b.png"):
        assert main(["render", "sound.mcap", "--to", name, "--size", "400x300", "--pictures", "2"]) == 0
    assert (desk / "a.png").read_bytes() == (desk / "b.png").read_bytes()
    assert (desk / "sound.mcap").read_bytes() == INSERTION.read_bytes()
    assert capsys.readouterr().out.count("2 pictures") == 2
    assert os.environ.get("MUJOCO_GL") != "off"


def test_a_trial_of_a_rig_is_drawn(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    require_graphics()
    write_log(desk / "rig.mcap", [tick(k) for k in range(30)], begin=start(world="bench", world_json="{}"))
    assert "4 pictures of 0.00 to 0.21 s" in rendered("rig.mcap --to rig.gif --size 200x150 --fps 10", capsys)


@pytest.mark.parametrize(
    ("words", "named", "accepted"),
    [
        ("sound.mcap", "to = ''", ".mp4, .gif, .png"),
        ("sound.mcap --to a.avi", "to = 'a.avi'", ".mp4, .gif, .png"),
        ("sound.mcap --to png", "to = 'png'", ".mp4, .gif, .png"),
        ("sound.mcap --to there.png", "there.png", "never overwritten; name another file with --to"),
        ("sound.mcap --to folder.gif", "folder.gif", "name another file with --to"),
        ("sound.mcap --to a.gif --size 0", "size = '0'", "as in 640x480"),
        ("sound.mcap --to a.gif --size 0x0", "size = '0x0'", "120 to 4096"),
        ("sound.mcap --to a.gif --size 5000x100", "size = '5000x100'", "120 to 4096"),
        ("sound.mcap --to a.gif --size 640x-480", "size = '640x-480'", "as in 640x480"),
        ("sound.mcap --to a.mp4 --size 641x480", "size = '641x480'", "even"),
        ("sound.mcap --to a.png --size 400x300 --pictures 9", "size = '400x300'", "fewer pictures"),
        ("sound.mcap --to a.gif --fps -5", "fps = -5.0", "from 0.1 to 50"),
        ("sound.mcap --to a.gif --fps 60", "fps = 60.0", "from 0.1 to 50"),
        ("sound.mcap --to a.mp4 --fps nan", "fps = nan", "from 0.1 to 240"),
        ("sound.mcap --to a.mp4 --fps many", "--fps", "float"),
        ("sound.mcap --to a.gif --speed 0", "speed = 0.0", "from 0.001"),
        ("sound.mcap --to a.gif --speed 0.001", "fps = 12.5", "a greater speed"),
        ("sound.mcap --to a.gif --begin-s 9", "begin_s = 9.0", "from 0 to 2.114"),
        ("sound.mcap --to a.gif --begin-s 2 --end-s 1", "end_s = 1.0", "after the beginning"),
        ("sound.mcap --to a.png --pictures 0", "pictures = 0", "from 1 to 100"),
        ("sound.mcap --to a.gif --camera top", "camera = 'top'", "both, close-up, arm"),
        ("torn.mcap --to a.gif", "torn.mcap: offset", "palpate log recover"),
        ("empty.mcap --to a.gif", "empty.mcap", "is empty"),
        ("text.mcap --to a.gif", "text.mcap", "is no MCAP file"),
        ("folder.mcap --to a.gif", "folder.mcap", "cannot be read"),
        ("missing.mcap --to a.gif", "missing.mcap", "cannot be read"),
        ("seven.mcap --to a.gif", "seven.mcap: /start", "what the cell looked like"),
    ],
)
def test_what_cannot_be_drawn_is_told_in_one_line(
    desk: Path, capsys: pytest.CaptureFixture[str], words: str, named: str, accepted: str
) -> None:
    line = refused_here(f"render {words}", desk, capsys)
    assert named in line
    assert accepted in line


def test_a_folder_that_is_not_there_is_told(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    require_graphics()
    assert "cannot be written" in refused_here("render sound.mcap --to nowhere/a.png", desk, capsys)


def test_without_a_graphics_library_the_packages_are_named(
    desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(graphics, "problem_with", lambda library: "not here")
    assert "libgl1-mesa-dri" in refused_here("render sound.mcap --to a.png", desk, capsys)


def test_without_pyav_the_extra_is_named_before_anything_is_drawn(
    desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.setattr(graphics, "problem_with", lambda library: pytest.fail("too early"))
    assert "palpate[video]" in refused_here("render sound.mcap --to a.mp4", desk, capsys)


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
def test_what_cannot_be_viewed_is_told_in_one_line(
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: str,
    named: str,
    accepted: str,
) -> None:
    for name in live.DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    line = refused_here(f"view {words}", desk, capsys)
    assert named in line
    assert accepted in line


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
def test_trials_are_shown_until_they_are_done_or_nobody_watches(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], patience: int, trials: int
) -> None:
    from palpate.adapters.cli import view

    window = Window(patience)

    def opened(model: Any, data: Any, target_m: tuple[float, float, float]) -> Window:
        assert target_m == pytest.approx((0.4, 0.0, 0.02))
        return window

    monkeypatch.setattr(view, "open_viewer", opened)
    monkeypatch.setattr(view, "require_display", lambda: None)
    assert main(["view", "--policy", "torque", "--trials", "2", "--speed", "100"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert [line.split(",")[0] for line in printed] == [f"trial {k}: inserted" for k in range(trials)]
    assert window.shown == patience or window.shown > 400
