"""What runs for the first time runs slowly: a trial in the simulator before one on devices that will not wait."""

from __future__ import annotations

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments.build import build_perception, build_task, supervisor_of
from palpate.adapters.experiments.policies import comparator
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.insertion import ReadyPose, TrialReport


def warm_up(config: RunConfig, ready: ReadyPose) -> TrialReport:
    """Run one whole trial in the simulator, with parts of its own, so that nothing of it reaches the run.

    Late imports, caches and the interpreter's own adaptation then do not fall on the first ticks of a real arm.

    Returns:
        What the trial came to.
    """
    with SimulatedRig(config, ready) as rig:
        rig.prepare(0)
        policy = comparator("torque", config, lambda: rig.truth().hole_in_task_m)
        task = build_task(config, ready, build_perception(RunConfig(task=config.task)), policy)
        return run_trial(task, rig.ports, trial_setup(config, 0), supervisor_of(rig, config, ready))
