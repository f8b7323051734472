"""Videos as MP4 or GIF; each frame is written as soon as it is rendered."""

from collections.abc import Iterable
from fractions import Fraction
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Final

from PIL import Image

from palpate.core.errors import UsageError

HOLD_S: Final = 1.0
"""Time for which a video shows its last frame."""


def require_video() -> Any:
    """Return PyAV, which is installed by one of palpate's extras.

    Raises:
        UsageError: PyAV is not installed, or lacks the encoder.
    """
    try:
        import av
    except ImportError:
        raise UsageError("MP4 needs PyAV; install it with: pip install 'palpate[video]'; or make a .gif") from None
    if "libx264" not in av.codecs_available:
        raise UsageError("this PyAV cannot encode H.264 (libx264); install the one of PyPI, or make a .gif")
    return av


def write_mp4(path: Path, pictures: Iterable[Image.Image], fps: float) -> None:
    """Write RGB images of equal size, with even width and height, as H.264, which every player can decode.

    Identical images give identical bytes with the same version of PyAV.

    Raises:
        UsageError: PyAV is not installed.
    """
    av = require_video()
    rate = Fraction(fps).limit_denominator(1000)
    frames = iter(pictures)
    first = next(frames)
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        # One thread, because the bytes depend on the number of threads.
        stream = container.add_stream("libx264", rate=rate, options={"crf": "20", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = *first.size, "yuv420p"
        last = first
        for last in chain((first,), frames):
            container.mux(stream.encode(av.VideoFrame.from_image(last)))
        for _ in range(round(HOLD_S * fps)):
            container.mux(stream.encode(av.VideoFrame.from_image(last)))
        container.mux(stream.encode())


def write_gif(path: Path, pictures: Iterable[Image.Image], fps: float, count: int) -> None:
    """Write ``count`` RGB images of equal size as a looping GIF, with times in hundredths of a second."""
    # Rounded so that errors do not add up.
    ends = [round(100 * k / fps) for k in range(count + 1)]
    durations_ms = [10 * (b - a) for a, b in pairwise(ends)]
    durations_ms[-1] += round(1000 * HOLD_S)
    frames = iter(pictures)
    first = next(frames)
    first.save(path, "GIF", save_all=True, append_images=frames, duration=durations_ms, loop=0)
