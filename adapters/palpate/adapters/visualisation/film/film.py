"""Films as MP4 or GIF; each picture is written as it is painted."""

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Final

from PIL import Image

from palpate.adapters.mujoco import ACTION, FORCE
from palpate.core.errors import UsageError

HOLD_S: Final = 1.0
"""How long a film rests on its last picture."""
_GIF_COLOURS: Final = 255
_GIF_TICKS_PER_S: Final = 100
_QUALITY: Final = "20"
_PATCH_PX: Final = 24


def require_video() -> Any:
    """PyAV, which an extra of palpate brings.

    Raises:
        UsageError: It is not installed, or without the encoder.
    """
    try:
        import av
    except ImportError:
        raise UsageError("MP4 needs PyAV; install it with: pip install 'palpate[video]'; or make a .gif") from None
    if "libx264" not in av.codecs_available:
        raise UsageError("this PyAV cannot encode H.264 (libx264); install the one of PyPI, or make a .gif")
    return av


def write_mp4(path: Path, pictures: Iterable[Image.Image], fps: float) -> None:
    """H.264, which every player decodes, of RGB pictures of one size with even sides; at least one.

    Equal pictures give equal bytes with equal versions of PyAV.

    Raises:
        UsageError: PyAV is not there.
    """
    av = require_video()
    rate = Fraction(fps).limit_denominator(1000)
    frames = iter(pictures)
    first = next(frames)
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        # One thread: with more of them the bytes depend on their number.
        stream = container.add_stream("libx264", rate=rate, options={"crf": _QUALITY, "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = *first.size, "yuv420p"
        for picture in _held(chain((first,), frames), round(HOLD_S * fps)):
            container.mux(stream.encode(av.VideoFrame.from_image(picture)))
        container.mux(stream.encode())


def write_gif(
    path: Path, pictures: Iterable[Image.Image], fps: float, count: int, samples: Sequence[Image.Image]
) -> None:
    """A GIF of ``count`` RGB pictures of one size, which begins again and again.

    All pictures have the same colours, taken from the samples, which keeps it small. The format counts time in
    hundredths of a second.
    """
    palette = _common_palette(samples)
    frames = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
    first = next(frames)
    first.save(path, "GIF", save_all=True, append_images=frames, duration=gif_durations_ms(count, fps), loop=0)


def gif_durations_ms(count: int, fps: float) -> list[int]:
    """How long each picture stays: whole hundredths of a second, rounded so that no error adds up."""
    ends = [round(_GIF_TICKS_PER_S * k / fps) for k in range(count + 1)]
    durations = [10 * (b - a) for a, b in pairwise(ends)]
    durations[-1] += round(1000 * HOLD_S)
    return durations


def _held(pictures: Iterable[Image.Image], times: int) -> Iterator[Image.Image]:
    for picture in pictures:
        yield picture
    for _ in range(times):
        yield picture


def _common_palette(samples: Sequence[Image.Image]) -> Image.Image:
    # Below the samples a patch of what is small and matters: else the arrows' colours would be lost among many greys.
    width, height = samples[0].size
    strip = Image.new("RGB", (width, height * len(samples) + 2 * _PATCH_PX))
    for k, colour in enumerate((FORCE, ACTION)):
        strip.paste(colour, (0, strip.height - (k + 1) * _PATCH_PX, width, strip.height - k * _PATCH_PX))
    for k, picture in enumerate(samples):
        strip.paste(picture, (0, k * height))
    return strip.quantize(_GIF_COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
