"""A contact model as arrows: the torque that is felt around the hole."""

from typing import Final

import numpy as np

from palpate.adapters.visualisation.report.page import Picture
from palpate.adapters.visualisation.report.pictures import COLOURS, drawn
from palpate.core.policy import LearnerEntry
from palpate.core.policy.belief import Directions

_MOST_MM: Final = 3.6
"""Arrows reach this far from the hole; there are few contacts beyond."""
_SPACING_MM: Final = 0.6


def touch_pictures(belief: LearnerEntry) -> tuple[Picture, ...]:
    """Draw the contact model of a belief; nothing while it has learned too little."""
    model = belief.touch_model
    if model is None:
        return ()
    axis_mm = np.arange(-_MOST_MM, _MOST_MM + 1e-9, _SPACING_MM)
    x_mm, y_mm = (grid.reshape(-1) for grid in np.meshgrid(axis_mm, axis_mm))
    # A tip at (x, y) has the hole at (-x, -y) from it.
    torque_Nmm = 1e3 * model.expected_Nm(Directions.of(-1e-3 * x_mm, -1e-3 * y_mm))
    with drawn(5.0, 5.0) as canvas:
        axes = canvas.figure.add_subplot()
        axes.quiver(x_mm, y_mm, torque_Nmm[:, 0], torque_Nmm[:, 1], angles="xy", pivot="middle", color=COLOURS[0])
        axes.plot(0.0, 0.0, "o", color=COLOURS[1], markersize=9, fillstyle="none", markeredgewidth=2.0)
        axes.invert_yaxis()
        axes.set(aspect="equal", xlabel="tip from the hole, x [mm]", ylabel="y [mm], down as seen from above")
    largest_Nmm = float(np.hypot(*torque_Nmm.T).max())
    trials = len(belief.state["trials"])
    caption = (
        f"Torque about the tip, pressed with 4.9 N, fitted to {model.touches} contacts of {trials} trials;"
        f" the longest arrow is {largest_Nmm:.0f} N mm. Circle: the hole."
    )
    return (Picture(f"Contact model. {caption}", caption, canvas.content),)
