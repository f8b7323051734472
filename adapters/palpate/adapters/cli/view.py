"""``palpate view``."""

import sys
from contextlib import suppress
from dataclasses import replace

from typing_extensions import override

from palpate.adapters.cli.picture_options import ViewOptions
from palpate.adapters.experiments import (
    FIRST_EVALUATION_TRIAL,
    ChosenPolicy,
    ScoredTrial,
    policy_for,
    ready_pose,
    require_usable,
    run_policy,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.visualisation import ShownClock, Viewer, WindowClosedError, open_viewer, require_display
from palpate.simulation.work_cell import WorkCell


class _Window(Viewer):
    """The viewer shows the model that it was opened with; when the cell makes another, that one stands as it does."""

    def __init__(self, viewer: Viewer, cell: WorkCell) -> None:
        self._viewer, self._cell, self._model, self._data = viewer, cell, cell.model, cell.data

    @override
    def sync(self) -> None:
        if self._cell.data is not self._data:
            self._cell.pose(self._model, self._data)
        self._viewer.sync()

    @override
    def is_running(self) -> bool:
        return self._viewer.is_running()


def view(options: ViewOptions) -> int:
    """Run trials in a window; returns the exit code."""
    config = options.run
    chosen = ChosenPolicy(policy_for(config, options.policy), config)
    require_display()
    ready = ready_pose(config)
    require_usable(config, ready)
    goal = config.task.goal
    target_m = (goal.x_mm * 1e-3, goal.y_mm * 1e-3, goal.z_mm * 1e-3)
    with (
        SimulatedRig(config, ready) as rig,
        open_viewer(rig.cell.model, rig.cell.data, target_m) as window,
        suppress(WindowClosedError),
    ):
        shown = ShownClock(rig.ports.clock, _Window(window, rig.cell), options.speed)
        rig.ports = replace(rig.ports, clock=shown)

        def done(scored: ScoredTrial) -> None:
            report = scored.report
            outcome = "" if report.outcome is None else report.outcome.value
            number = report.setup.index - FIRST_EVALUATION_TRIAL
            sys.stdout.write(f"trial {number}: {outcome}, exploration {report.exploration_time_s:.2f} s\n")

        rows = run_policy(config, ready, rig, chosen.perception, chosen.on(rig), options.trials, done)
        return 0 if len(rows) == options.trials else 130
    return 0
