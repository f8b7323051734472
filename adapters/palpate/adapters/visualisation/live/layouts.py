"""Ready layouts: what stands where in a viewer."""

import shutil
from pathlib import Path
from typing import Final

from palpate.adapters.visualisation.live.live_view import require_viewer

_FOXGLOVE: Final = Path(__file__).with_name("foxglove-layout.json")
"""As Foxglove exports it; the camera looks at the default goal."""


def write_layout(viewer: str, path: Path) -> None:
    """Write the layout for a viewer: JSON for Foxglove, a blueprint for Rerun, which ``--live rerun`` brings along.

    Raises:
        UsageError: It is Rerun's, whose package is not installed.
    """
    if viewer == "foxglove":
        shutil.copyfile(_FOXGLOVE, path)
        return
    require_viewer(viewer)
    from palpate.adapters.visualisation.live.rerun_display import layout

    layout().save("palpate", path)
