"""Films, of pictures that were never drawn by a graphics library."""

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from palpate.adapters.mujoco import ACTION, FORCE
from palpate.adapters.visualisation.film import require_video, write_gif, write_mp4
from palpate.adapters.visualisation.film.film import HOLD_S, gif_durations_ms
from palpate.core.errors import UsageError

SIZE = (160, 120)


def pictures(count: int) -> list[Image.Image]:
    """A bright square that wanders over a grey ground, and a little of the arrows' colours."""
    made = []
    for k in range(count):
        picture = Image.new("RGB", SIZE, (120, 125, 130))
        picture.paste((250, 240, 60), (10 + 10 * k, 20, 30 + 10 * k, 40))
        picture.paste(FORCE, (2, 100, 6, 104))
        picture.paste(ACTION, (12, 100, 16, 104))
        made.append(picture)
    return made


def test_an_mp4_has_every_picture_and_rests_on_the_last(tmp_path: Path) -> None:
    path = tmp_path / "film"
    made = pictures(6)
    write_mp4(path, made, 10.0)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, float(stream.average_rate or 0)) == ("h264", 10.0)
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(frames) == 6 + round(10 * HOLD_S)
    for frame, picture in zip(frames, made, strict=False):
        assert np.abs(frame.astype(float) - np.array(picture)).mean() < 4.0
    assert np.abs(frames[-1].astype(float) - np.array(made[-1])).mean() < 4.0


def test_a_gif_shows_every_picture_in_its_colours_for_its_time(tmp_path: Path) -> None:
    made = pictures(5)
    write_gif(tmp_path / "film", iter(made), 12.5, 5, made[::2])
    with Image.open(tmp_path / "film") as film:
        assert (film.format, film.n_frames, film.info["loop"]) == ("GIF", 5, 0)
        durations = []
        for k, picture in enumerate(made):
            film.seek(k)
            durations.append(film.info["duration"])
            shown = np.array(film.convert("RGB"))
            assert np.abs(shown.astype(int) - np.array(picture)).max() < 24
    assert durations == [80, 80, 80, 80, 1080]


def test_rounding_of_a_gifs_times_does_not_add_up() -> None:
    durations = gif_durations_ms(61, 30.0)
    assert set(durations[:-1]) == {30, 40}
    assert sum(durations[:60]) == 2000
    assert durations[-1] == 30 + 1000 * HOLD_S


def test_a_pyav_without_the_encoder_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(av, "codecs_available", {"mpeg4"})
    with pytest.raises(UsageError, match="libx264"):
        require_video()
