"""``palpate/PegInsertion-v0`` and ``-6Dof-v0``: a run's peg-in-hole task, with one decision per step."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping
from copy import deepcopy
from functools import partial
from typing import Any, Final

import gymnasium
import mujoco
import numpy as np

from palpate.adapters.config import RunConfig, Tables, configured, without_world
from palpate.adapters.experiments import Run, rest_reinforcement, task_actions
from palpate.adapters.gymnasium_envs import spaces
from palpate.adapters.gymnasium_envs.episode import Episodes, NotRunningError
from palpate.adapters.mujoco import DrawnCell, SimulatedRig, Stage
from palpate.core.errors import ConfigurationError, LifecycleError, require_in, require_one_of, require_whole
from palpate.core.ports import PERIOD_S, Rig
from palpate.core.trial import Outcome
from palpate.simulation.work_cell import WorkCell

_NAME: Final = "palpate/PegInsertion-v0"
_MOST_TRIALS: Final = 1_000_000_000
_SIZE: Final = (640, 480)
"""Image width and height in pixels."""


class _RunningCell(DrawnCell):
    """The simulated cell, drawn from a copy of its model, whose colours and cuts may be changed."""

    def __init__(self, config: RunConfig, cell: WorkCell) -> None:
        self._source, self._plate = cell, cell.model.body("plate").id
        self.model = deepcopy(cell.model)
        self.data = mujoco.MjData(self.model)
        self.hole_known, self.joints = True, cell.joints
        self.peg, self.contour = config.cell.peg, config.cell.contour.shape != "none"
        self.peg_diameter_m = self.peg.diameter_mm * 1e-3
        self.plate_depth_m = self.peg.hole_depth_mm * 1e-3 + 0.005
        self.follow()

    def follow(self) -> None:
        """Copy the current pose of the simulated cell."""
        self._source.pose(self.model, self.data)
        self.mouth_m = self.model.body_pos[self._plate].copy()


class PegInsertionEnv(gymnasium.Env[Any, Any]):
    """The insertion task as an environment. Perception, motion, supervision and reward are as in any other run.

    A step is one decision: 14 control ticks at 140 Hz, or more if it reaches the hole. ``reset`` lifts the peg, moves
    it to the trial's start, tares, touches the plate, and runs to the first decision. Episodes after ``reset(seed=s)``
    are the trials 0, 1, 2, ... of ``palpate train --seed s``; ``options={"trial": k}`` selects one.

    An insertion or a failure (jam, force limit, safety trip) terminates an episode; the time limit truncates it.

    Args:
        scenario: ``paper``, ``blind`` or another preset; if empty, the one in ``config``, or ``job`` with a job,
            or ``paper``.
        arm: ``zebra-zero`` or ``ur5``; if empty, the one in ``config``.
        actions: ``discrete``: the actions of palpate's own learners, the eight compass steps, or options until their
            termination; ``continuous``: any step in the plane, (2,), see
            :class:`~palpate.adapters.gymnasium_envs.spaces.FreeSteps`, or any motion of a tool that turns, (6,), see
            :class:`~palpate.adapters.gymnasium_envs.spaces.Twists`.
        observations: ``symbolic``: the state's number; ``raw``: tip and wrench, (9,), or with the orientation of a
            tool that turns, (12,), see :class:`~palpate.adapters.gymnasium_envs.spaces.TipWrench`; ``ports``: port
            data, see :class:`~palpate.adapters.gymnasium_envs.spaces.PortReadings`.
        failure_penalty: Penalty subtracted from the last reward of a failed episode. None uses the cost of the
            decisions left until the time limit, so failing early gains nothing; 0 uses only the core's reinforcement.
        config: Any other settings: a nested table such as ``{"task": {"step_mm": 0.5}}``, or a TOML file.
        render_mode: None, or ``rgb_array``: close-ups of the peg and the hole, (480, 640, 3); not on a rig.
        rig: Rig file; the trials run on this rig in real time, supervised and recorded. If empty, the simulator is
            used.
        out: On a rig, the folder for the recording; if empty, the next free one, ``runs/paper-environment-001``.
        decision_limit_s: On a rig, time limit for a decision, 0.01 s to 60 s. A late decision is replaced by a pause
            and counted; after this time the arm is stopped and the rig latched.
        task: Kind of insertion; if empty, the one in ``config``, or steps in the plane.
        acknowledge: On a rig with an open fault, its acknowledgement: ``NUMBER NAME: why``.
        accept_kinematics: On a rig, allow motion with the arm's nominal model.
        job: Job file or its tables: part, tool, arm, place and limits. None uses the paper's job. A rig needs a job
            here, in ``config`` or in its file.

    Raises:
        ConfigurationError: A setting is unknown, or an argument or setting is rejected.
        DeviceError: A device in the rig failed.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - Gymnasium declares it so

    def __init__(
        self,
        scenario: str = "",
        arm: str = "",
        actions: str = "discrete",
        observations: str = "symbolic",
        failure_penalty: float | None = None,
        config: Tables = None,
        render_mode: str | None = None,
        rig: str = "",
        out: str = "",
        decision_limit_s: float = 0.3,
        task: str = "",
        acknowledge: str = "",
        accept_kinematics: bool = False,
        job: Tables = None,
    ) -> None:
        # A copy starts with the same arguments; its episodes depend on its own seeds.
        self._copy = partial(
            PegInsertionEnv,
            scenario,
            arm,
            actions,
            observations,
            failure_penalty,
            config,
            render_mode,
            task=task,
            job=job,
        )
        require_one_of("actions", actions, spaces.ACTION_KINDS)
        require_one_of("observations", observations, spaces.OBSERVATION_KINDS)
        if failure_penalty is not None:
            require_in("failure_penalty", failure_penalty, 0.0, 1e9)
        if render_mode not in (None, "rgb_array"):
            raise ConfigurationError("render_mode", render_mode, "rgb_array, or None")
        if rig and render_mode is not None:
            raise ConfigurationError("render_mode", render_mode, "None on a rig, which cannot be rendered")
        self.render_mode = render_mode
        self._drawn: tuple[_RunningCell, Stage] | None = None
        settings = configured(job, rig=rig, scenario=scenario, arm=arm, task=task, settings=config)
        run = Run(
            without_world(settings) if rig else settings,
            rig=rig, acknowledge=acknowledge, accept_kinematics=accept_kinematics,
        )  # fmt: skip
        self._episodes = Episodes(run, out, decision_limit_s)
        # The finalizer also runs at program exit, so an environment that was not closed still stops the arm.
        weakref.finalize(self, self._episodes.close)
        self._penalty = failure_penalty
        longest_m = settings.task.step_mm * 1e-3
        self._actions: spaces.Actions
        if actions == "discrete":
            self._actions = spaces.NumberedActions(task_actions(settings))
        elif spaces.spatial_of(settings) is not None:
            self._actions = spaces.Twists(longest_m, settings.task.ticks_per_action * PERIOD_S)
        else:
            self._actions = spaces.FreeSteps(longest_m)
        seen: spaces.Observations
        if observations == "symbolic":
            seen = spaces.StateIndex(len(self._episodes.perception.states))
        elif observations == "raw":
            seen = spaces.TipWrench(settings)
        else:
            seen = spaces.PortReadings(len(run.ready.q_rad))
        self._episodes.observe = seen.of
        self.action_space, self.observation_space = self._actions.space, seen.space
        self._seed, self._next, self._closed = -1, 0, False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Run the next trial to its first decision.

        Args:
            seed: Seed for this and the following trials; None keeps the current seed.
            options: ``{"trial": k}`` selects a trial; anything else is rejected.

        Raises:
            ConfigurationError: An option is unknown or rejected.
            DeviceError: Too many trials ended before a decision.
        """
        if self._closed:
            raise NotRunningError("the environment is closed; make another")
        super().reset(seed=seed)
        given = {} if options is None else options
        if not isinstance(given, Mapping) or not {"trial"}.issuperset(given):
            raise ConfigurationError("options", options, 'a table such as {"trial": 3}, or None')
        trial = given.get("trial", self._next if seed is None else 0)
        require_whole("options.trial", trial, 0, _MOST_TRIALS)
        if seed is not None:
            require_whole("seed", seed, 0, 2**63 - 1)
            self._seed = seed
        elif self._seed < 0:
            self._seed = int(self.np_random.integers(2**31))
        self._episodes.begin(self._seed, trial)
        self._next = self._episodes.trial + 1
        return self._episodes.seen()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Execute one decision; the reward is its reinforcement.

        Raises:
            ActionRefusedError: The action does not exist; nothing was done.
            NotRunningError: No episode is running.
        """
        episodes = self._episodes
        if not episodes.running:
            raise NotRunningError(
                "the environment is closed; make another" if self._closed
                else "no episode runs; call reset() before the first step, and after an episode has ended"
            )  # fmt: skip
        earned = episodes.decide(self._actions.decision(action))
        over = not episodes.running
        truncated = over and episodes.outcome is Outcome.TIME_LIMIT
        reward = earned
        if over and not truncated and episodes.outcome is not Outcome.INSERTED:
            rest = rest_reinforcement(episodes.config, episodes.exploration_time_s)
            reward += rest if self._penalty is None else -self._penalty
        observation, info = episodes.seen()
        return observation, reward, over and not truncated, truncated, info

    def render(self) -> Any:
        """Return an image of the cell if ``render_mode`` is set; otherwise None.

        Raises:
            UsageError: No OpenGL backend works.
        """
        if self.render_mode is None or self._closed:
            return None
        if self._drawn is None:
            drawn = _RunningCell(self._episodes.config, self.cell)
            self._drawn = drawn, Stage(drawn, _SIZE)
        cell, stage = self._drawn
        cell.follow()
        return np.ascontiguousarray(stage.picture(cell.close_up(), *_SIZE))

    @property
    def cell(self) -> WorkCell:
        """Return the work cell with its MuJoCo model and data, for images and measurements but not for agents.

        Raises:
            LifecycleError: The environment is on a rig.
        """
        rig = self._episodes.rig
        if self._episodes.on_rig or not isinstance(rig, SimulatedRig):
            raise LifecycleError(_NAME, "on a rig", "cell", "only a simulated cell has a model")
        return rig.cell

    @property
    def rig(self) -> Rig:
        """Return the rig used for the trials, with its ports and its fault latch.

        Only a person may decide to call ``rig.latch.acknowledge(by, reason)``.
        """
        return self._episodes.rig

    def __reduce__(self) -> tuple[Callable[..., PegInsertionEnv], tuple[()]]:
        """Support copying.

        Raises:
            LifecycleError: The environment is on a rig, which has only one arm.
        """
        if self._episodes.on_rig:
            raise LifecycleError(_NAME, "on a rig", "pickling or copying", "make it in the process that drives the arm")
        return self._copy, ()

    def close(self) -> None:
        """Stop the arm and close the work cell."""
        if not self._closed:
            self._closed = True
            if self._drawn is not None:
                self._drawn[1].close()
            self._episodes.close()
