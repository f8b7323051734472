"""A touch model as arrows: which torque is felt where round the hole; and where holes were."""

from math import hypot
from typing import Final

import numpy as np

from palpate.adapters.visualisation.report.canvas import COLOURS, GREY, WIDTH_IN, drawn
from palpate.adapters.visualisation.report.page import Picture, counted
from palpate.core.policy import LearnerEntry
from palpate.core.policy.belief import RINGS_M, Directions, TouchModel

_MOST_MM: Final = 3.6
"""Arrows reach so far from the hole; beyond there are few touches."""
_SPACING_MM: Final = 0.6


def touch_pictures(name: str, belief: LearnerEntry, title: str) -> tuple[Picture, ...]:
    """The touch model of a belief; none while it has learned too little."""
    model = belief.touch_model
    return () if model is None else (_arrows(name, model, belief, title),)


def _arrows(name: str, model: TouchModel, belief: LearnerEntry, title: str) -> Picture:
    axis_mm = np.arange(-_MOST_MM, _MOST_MM + 1e-9, _SPACING_MM)
    x_mm, y_mm = (grid.reshape(-1) for grid in np.meshgrid(axis_mm, axis_mm))
    # A tip at (x, y) has the hole at (-x, -y) from it.
    torque_Nmm = 1e3 * model.expected_Nm(Directions.of(-1e-3 * x_mm, -1e-3 * y_mm))
    with drawn(4.6, WIDTH_IN * 1.35) as canvas:
        left, right = canvas.figure.subplots(1, 2, width_ratios=(1.25, 1.0))
        left.quiver(
            x_mm, y_mm, torque_Nmm[:, 0], torque_Nmm[:, 1], angles="xy", pivot="middle", color=COLOURS[0], width=0.005
        )
        left.plot(0.0, 0.0, "o", color=COLOURS[1], markersize=9, fillstyle="none", markeredgewidth=2.0)
        left.invert_yaxis()
        left.set(aspect="equal", xlabel="tip from the hole, x, mm", ylabel="y, mm (downwards, seen from above)")
        rings_mm = 1e3 * np.array(RINGS_M)
        cue_Nmm = [1e3 * hypot(*cue) for cue in model.cue_Nm]
        noise_Nmm = 1e3 * np.array(model.noise_Nm)
        right.plot(rings_mm, cue_Nmm, "o-", color=COLOURS[0], label="torque")
        right.plot(rings_mm, noise_Nmm, "s--", color=GREY, label="noise")
        right.set(xlabel="distance from the hole, mm", ylabel="N mm", ylim=(0.0, None))
        right.legend(frameon=False)
    offset_Nmm = 1e3 * hypot(*model.offset_Nm)
    alt = (
        f"Touch model of {title}: torque {max(cue_Nmm):.0f} N mm at most, {cue_Nmm[6]:.0f} N mm at {rings_mm[6]:g} mm"
        f" from the hole; noise {noise_Nmm.min():.1f} to {noise_Nmm.max():.1f} N mm."
    )
    of = f"{counted(model.touches, 'touch', 'touches')} of {counted(len(belief.state['trials']), 'trial')}"
    caption = (
        f"{title}. Torque about the tip, pressed with 4.9 N, fitted to {of}; circle: the hole. Without the offset of"
        f" every touch, {offset_Nmm:.1f} N mm, and of a trial, {1e3 * model.bias_Nm:.1f} N mm (standard deviation)."
        " Right: without what differs from sector to sector, and the noise of a touch."
    )
    return Picture(name, alt, caption, canvas.content, wide=True)
