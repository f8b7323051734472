"""``palpate render`` on recorded trials, and on files that are none."""

import sys

import av
import pytest
from PIL import Image

from palpate.adapters.mujoco import graphics
from tests.support.graphics import INSERTION, require_graphics
from tests.unit.adapters.log.made_logs import start, tick, write_log


@pytest.fixture
def desk(tmp_path):
    """A sound log, and all kinds of files that are none."""
    sound = INSERTION.read_bytes()
    contents = {"sound.mcap": sound, "torn.mcap": sound[:500], "there.gif": b"a picture of mine"}
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    write_log(tmp_path / "seven.mcap", [tick(0)], begin=start(tip_rotation=(0.0,) * 7))
    return tmp_path


def test_films_in_every_format(palpate, desk):
    require_graphics()

    def rendered(words):
        return palpate.succeed("render", "sound.mcap", *words.split())

    printed = rendered("--to a.mp4 --size 200x150 --begin-s 0.5 --end-s 0.75")
    assert "8 pictures of 0.50 to 0.75 s of the trial in a.mp4" in printed
    with av.open(str(desk / "a.mp4")) as film:
        stream = film.streams.video[0]
        assert (stream.width, stream.height, float(stream.average_rate or 0)) == (200, 150, 25.0)
        # A second of rest follows.
        assert sum(1 for _ in film.decode(stream)) == 8 + 25
    rendered("--to a.GIF --size 200x150 --begin-s 0.5 --end-s 0.75 --speed 0.5 --camera arm")
    with Image.open(desk / "a.GIF") as film:
        assert (film.format, film.size, film.n_frames) == ("GIF", (200, 150), 8)


@pytest.mark.nightly
def test_equal_logs_give_equal_bytes_and_the_log_stays_as_it_is(palpate, desk):
    require_graphics()
    for name in ("a.gif", "b.gif"):
        palpate.succeed("render", "sound.mcap", "--to", name, "--size", "200x150", "--fps", 1)
    assert (desk / "a.gif").read_bytes() == (desk / "b.gif").read_bytes()
    assert (desk / "sound.mcap").read_bytes() == INSERTION.read_bytes()


@pytest.mark.nightly
def test_a_trial_of_a_rig_is_drawn(palpate, desk):
    require_graphics()
    write_log(desk / "rig.mcap", [tick(k) for k in range(30)], begin=start(world="bench", world_json="{}"))
    printed = palpate.succeed("render", "rig.mcap", "--to", "rig.gif", "--size", "200x150", "--fps", 10)
    assert "4 pictures of 0.00 to 0.21 s" in printed


@pytest.mark.parametrize(
    ("words", "named", "accepted"),
    [
        ("sound.mcap", "to is missing", ".mp4 or .gif"),
        ("sound.mcap --to there.gif", "there.gif", "never overwritten; name another file with --to"),
        ("sound.mcap --to a.gif --size 0x0", "size must be ", "120 to 4096 pixels each way (got '0x0')"),
        ("sound.mcap --to a.mp4 --size 641x480", "size must be two even numbers", "(got '641x480')"),
        ("sound.mcap --to a.gif --fps -5", "fps must be ", "from 0.1 to 50 (got -5.0)"),
        ("sound.mcap --to a.gif --speed 0.001", "fps must be lower, or the speed higher", "(got 12.5)"),
        ("sound.mcap --to a.gif --begin-s 1 --end-s 0.5", "end_s must be ", "after the beginning, 1 s (got 0.5)"),
        ("torn.mcap --to a.gif", "torn.mcap: contains nothing readable", "deleted"),
        ("seven.mcap --to a.gif", "seven.mcap: /start", "describe the cell"),
    ],
)
@pytest.mark.usefixtures("desk")
def test_what_cannot_be_drawn_is_refused_in_one_line(palpate, words, named, accepted):
    palpate.refuses(f"render {words}", named, accepted)


@pytest.mark.usefixtures("desk")
def test_without_a_graphics_library_the_packages_are_named(palpate, monkeypatch):
    monkeypatch.setattr(graphics, "problem_with", lambda library: "not here")
    assert "libgl1-mesa-dri" in palpate.refusal("render", "sound.mcap", "--to", "a.gif")


@pytest.mark.usefixtures("desk")
def test_without_pyav_the_extra_is_named_before_anything_is_drawn(palpate, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.setattr(graphics, "problem_with", lambda library: pytest.fail("too early"))
    assert "palpate[video]" in palpate.refusal("render", "sound.mcap", "--to", "a.mp4")
