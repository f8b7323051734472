"""Kinds of task by name, from palpate and from other packages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from math import hypot
from typing import TYPE_CHECKING, Final

from palpate.adapters.config.plugins import entries, from_here, imported
from palpate.core.errors import ConfigurationError, did_you_mean
from palpate.core.job import KEYED, SIDES

if TYPE_CHECKING:
    # The kinematics are loaded when a task is created.
    from palpate.adapters.config.run import RunConfig
    from palpate.core.trial import TaskKind

GROUP: Final = "palpate.tasks"
"""Entry-point group that names kinds of task."""
_FIELD: Final = "task.name"
_BESIDE_MM: Final = 1.0
"""Distance by which a specified corner may lie outside the peg, because drawings give rounded dimensions."""
INSERTION: Final = "insertion"
_OWN: Final[Mapping[str, str]] = {
    INSERTION: "palpate.core.tasks.insertion:INSERTION",
    "insertion-6dof": "palpate.core.tasks.insertion_6dof:INSERTION_6DOF",
}
"""Tasks found without searching the installed packages."""


@cache
def task_kind(name: str) -> TaskKind:
    """Return the named kind of task, or the one at ``package.module:Name``.

    Raises:
        ConfigurationError: There is no such object, or it is not a kind of task.
    """
    place = _OWN.get(name, "")
    if not place:
        others = entries(GROUP)
        if name not in others and ":" not in name:
            known = sorted({*_OWN, *others})
            accepted = f"one of {', '.join(known)}, or package.module:Name{did_you_mean(name, known)}"
            raise ConfigurationError(_FIELD, name, accepted)
        place = others[name].value if name in others else name
    with from_here():
        made = imported(_FIELD, place, "package.module:Name")
    missing = [each for each in ("preset", "queries_policy", "options", "workspace", "ready", "setup", "actions",
                               "make", "achieved") if not hasattr(made, each)]  # fmt: skip
    if missing:
        raise ConfigurationError(_FIELD, name, f"a palpate.core.trial.TaskKind; {place} has no {missing[0]}")
    kind: TaskKind = made
    return kind


def with_options(config: RunConfig) -> RunConfig:
    """Return the settings with all of the task's options, so that a record does not depend on defaults."""
    if config.task.name == INSERTION:
        return config
    from palpate.core.trial import options_of

    options = vars(options_of(task_kind(config.task.name).options, config.task))
    return replace(config, task=replace(config.task, options=dict(options)))


def require_corners(config: RunConfig) -> None:
    """Check the corners in the task's options against the peg in the simulated cell.

    Raises:
        ConfigurationError: Their number differs, or a corner would lie outside the peg or touch down outside the area.
    """
    options, peg = config.task.options, config.cell.peg
    sides, corners = SIDES.get(peg.cross_section, 0), options.get("corners", 0.0)
    most_mm = 1e3 * max(hypot(x, y) for x, y in peg.section().outline(peg.rim_spheres)) + _BESIDE_MM
    where = f"as the {peg.cross_section} peg of cell.peg.cross_section has"
    if corners and corners != sides:
        raise ConfigurationError("task.options.corners", corners, f"{sides}, {where}")
    if options.get("flat_deg") and peg.cross_section != KEYED:
        raise ConfigurationError("task.options.flat_deg", options["flat_deg"], f"0: only {KEYED} pegs have a flat")
    if corners and (corner_mm := options.get("corner_mm", 0.0)) > most_mm:
        raise ConfigurationError("task.options.corner_mm", corner_mm, f"at most {most_mm:.1f}, {where} its corners")
    if corners and (inside_mm := options.get("inside_mm", 0.0)) > config.task.area_half_width_mm:
        accepted = f"at most task.area_half_width_mm = {config.task.area_half_width_mm:g}"
        raise ConfigurationError("task.options.inside_mm", inside_mm, accepted)
