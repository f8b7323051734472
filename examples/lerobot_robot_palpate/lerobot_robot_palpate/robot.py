"""The insertion task as a LeRobot robot. An action is a step across the plate; an observation contains port data.

Palpate itself runs the phases without decisions (lift, transfer, tare, approach, insertion), and its supervisor
monitors all phases. After a trial has ended, the next action that is not a rest begins a new trial and moves the arm.
Record with ``--dataset.fps=10``, because palpate makes ten decisions per second.
"""

from __future__ import annotations

from math import hypot
from typing import Any

from lerobot.robots import Robot
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from lerobot_robot_palpate.config_palpate import PalpateConfig
from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from palpate.adapters.gymnasium_envs.spaces import PortReadings

_ACTIONS = ("delta_x", "delta_y")
_FACTS = ("trial", "trial_over", "trial_success")
_SOURCES = ("wrench", "joints")
_REST = 0.05
"""Fraction of a step below which an action counts as a rest."""


class Palpate(Robot):
    """A robot that inserts pegs in MuJoCo or on a rig.

    Observations contain ``joint_K_rad``, the raw sensor values ``force_x_N`` to ``torque_z_Nm``, and ``applied_K_rad``,
    the command applied in the previous tick. For the wrench and the joints they also contain the age in s and the
    run-clock time of measurement, split into whole seconds (``wrench_source_s``) and microseconds
    (``wrench_source_us``), both of which float32 represents exactly. Actions are ``delta_x`` and ``delta_y``, fractions
    of the maximum step from -1 to 1, in the task frame.
    """

    config_class = PalpateConfig
    name = "palpate"

    def __init__(self, config: PalpateConfig) -> None:
        super().__init__(config)
        self.config, self._readings = config, PortReadings(config.joints)
        self._env: PegInsertionEnv | None = None
        self._seen: dict[str, float] = {}

    @property
    def observation_features(self) -> dict[str, type]:
        """Return the name and type of each value in an observation."""
        names = [name for name in self._readings.names if not name.endswith("time_s")]
        times = [f"{source}_{part}" for source in _SOURCES for part in ("source_s", "source_us", "age_s")]
        return dict.fromkeys((*names, *times, *_FACTS), float)

    @property
    def action_features(self) -> dict[str, type]:
        """Return the name and type of each value in an action."""
        return dict.fromkeys(_ACTIONS, float)

    @property
    def is_connected(self) -> bool:
        """Return True if a cell or a rig is open."""
        return self._env is not None

    @property
    def is_calibrated(self) -> bool:
        """Return True, because ``palpate rig calibrate`` performs the calibration."""
        return True

    def calibrate(self) -> None:
        """Do nothing; see :attr:`is_calibrated`."""

    def configure(self) -> None:
        """Do nothing; :meth:`connect` applies the configuration."""

    def connect(self, calibrate: bool = True) -> None:
        """Open the cell or the rig, and run the first trial up to its first decision."""
        if self._env is not None:
            raise DeviceAlreadyConnectedError("palpate is connected already")
        c = self.config
        env = PegInsertionEnv(
            c.scenario, c.arm, "continuous", "ports", config=c.settings or None, rig=c.rig, out=c.out,
            decision_limit_s=c.decision_limit_s,
        )  # fmt: skip
        if env.observation_space.shape != (len(self._readings.names),):
            env.close()
            raise ValueError(f"robot.joints = {c.joints} is not the number of joints of this arm")
        self._env = env
        self._note(*env.reset(seed=c.seed))

    def get_observation(self) -> dict[str, float]:
        """Return the measurements from the time at which the latest decision was due."""
        self._connected()
        return dict(self._seen)

    def send_action(self, action: dict[str, Any]) -> dict[str, float]:
        """Take a step, shortened to the maximum step if necessary, and return the step that was taken."""
        env = self._connected()
        x, y = (float(action[name]) for name in _ACTIONS)
        scale = max(1.0, hypot(x, y))
        x, y = x / scale, y / scale
        if not self._seen["trial_over"]:
            observation, _, terminated, truncated, info = env.step((x, y))
            self._note(observation, info, over=terminated or truncated)
        elif hypot(x, y) >= _REST:
            self._note(*env.reset())
        return dict(zip(_ACTIONS, (x, y), strict=True))

    def disconnect(self) -> None:
        """Stop the arm and close everything."""
        self._connected().close()
        self._env = None

    def _connected(self) -> PegInsertionEnv:
        if self._env is None:
            raise DeviceNotConnectedError("palpate is not connected; call connect() first")
        return self._env

    def _note(self, observation: Any, info: dict[str, Any], *, over: bool = False) -> None:
        reading = dict(zip(self._readings.names, observation.tolist(), strict=True))
        time_s = reading.pop("time_s")
        for source in _SOURCES:
            source_s = reading.pop(f"{source}_source_time_s")
            whole_s, microseconds = divmod(round(1e6 * source_s), 1_000_000)
            reading |= {f"{source}_source_s": float(whole_s), f"{source}_source_us": float(microseconds)}
            reading[f"{source}_age_s"] = time_s - source_s
        facts = float(info["trial"]), float(over), float(info["is_success"])
        self._seen = reading | dict(zip(_FACTS, facts, strict=True))
