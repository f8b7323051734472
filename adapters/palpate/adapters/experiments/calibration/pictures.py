"""A picture of each step's data, with what was made of them."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from palpate.adapters.experiments.calibration.estimates import Array, Estimate, Rest, ToolLoad
from palpate.adapters.experiments.calibration.steps import Touched
from palpate.adapters.log import drawing

_SIZE_IN: Final = (7.0, 3.2)
_DPI: Final = 120
_AXES: Final = "xyz"


def rest_picture(wrenches: Array, rest: Rest) -> bytes:
    """Force and torque at rest, less their means, with two standard deviations."""
    with drawing(*_SIZE_IN, _DPI) as canvas:
        rows = (("force, N", rest.noise_N, slice(3)), ("torque, N m", rest.noise_Nm, slice(3, 6)))
        for panel, (label, noise, part) in zip(canvas.figure.subplots(1, 2), rows, strict=True):
            panel.plot(wrenches[:, part] - wrenches[:, part].mean(axis=0), lw=0.5, label=list(_AXES))
            panel.axhspan(-2.0 * noise.value, 2.0 * noise.value, color="0.9", zorder=0)
            panel.set(xlabel="sample", ylabel=label)
        panel.legend()
        canvas.figure.suptitle("less the mean; grey: two standard deviations", fontsize=8)
    return canvas.content


def weigh_picture(load: ToolLoad, down_in_tool: Array, means: Array) -> bytes:
    """Measured wrenches, pose by pose, beside those of the tool that was found."""
    fitted = load.wrenches(down_in_tool)
    with drawing(*_SIZE_IN, _DPI) as canvas:
        rows = (("force, N", slice(3)), ("torque, N m", slice(3, 6)))
        for panel, (label, part) in zip(canvas.figure.subplots(1, 2), rows, strict=True):
            for k, axis in enumerate(_AXES):
                panel.plot(fitted[:, part][:, k], lw=0.8, color=f"C{k}")
                panel.plot(means[:, part][:, k], "o", ms=4, color=f"C{k}", label=axis)
            panel.set(xlabel="pose", ylabel=label)
        panel.legend()
        canvas.figure.suptitle("dots: measured; lines: the tool that was found", fontsize=8)
    return canvas.content


def touch_picture(touched: Touched) -> bytes:
    """Force over depth at each place, with the spring that was found."""
    with drawing(*_SIZE_IN, _DPI) as canvas:
        panel = canvas.figure.subplots()
        for place, data in enumerate(touched.pressed, start=1):
            panel.plot(data.depth_m * 1e3, data.force_N, ".", ms=2, label=f"place {place}")
        most = max(float(data.force_N.max()) for data in touched.pressed)
        depth_m = touched.depth_m.value
        ends = np.array([depth_m, depth_m + most / touched.stiffness_N_per_m.value]) * 1e3
        panel.plot(ends, (0.0, most), "k", lw=0.8)
        panel.set(xlabel="depth below the believed plate, mm", ylabel="force, N")
        panel.set_title("line: the spring that was found; its foot is the plate", fontsize=8)
        panel.legend()
    return canvas.content


def hole_picture(places_m: Sequence[tuple[float, float]], x: Estimate, y: Estimate) -> bytes:
    """Where the peg came to rest, with two standard deviations of the mean."""
    with drawing(3.6, 3.2, _DPI) as canvas:
        panel = canvas.figure.subplots()
        panel.plot(*(np.array(places_m).T * 1e3), "o", ms=4)
        panel.errorbar(x.value * 1e3, y.value * 1e3, yerr=2e3 * y.sd, xerr=2e3 * x.sd, color="k")
        panel.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
        panel.set_title("dots: where the peg came to rest\ncross: mean, two standard deviations", fontsize=8)
        panel.ticklabel_format(useOffset=False)
    return canvas.content
