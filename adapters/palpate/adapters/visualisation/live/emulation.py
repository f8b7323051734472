"""The emulated cell in a live view: it has no trials, only an arm that somebody moves."""

from typing import Final

from palpate.adapters.config import RunConfig, to_toml
from palpate.adapters.hardware import CellMoment
from palpate.adapters.log import (
    EVENT,
    SCHEMA,
    START,
    TICK,
    ChannelKind,
    EventEntry,
    Sink,
    StartRecord,
    TickRecord,
    dump_json,
    encode_record,
    message_frame,
)
from palpate.adapters.visualisation.live.trial_stream import POSE_TICKS
from palpate.core.ports import SIMULATOR, AppliedCommand, JointSample, Truth, WrenchSample
from palpate.core.trial import ReadyPose

_TRIAL: Final = 0
"""The emulated cell is that of a seed's first trial."""


class EmulationView:
    """Shows the cell as if it were one long trial."""

    def __init__(self, live: Sink, config: RunConfig, ready: ReadyPose, truth: Truth) -> None:
        self._live, self._tick, self._now_ns = live, 0, 0
        start = StartRecord(
            schema=SCHEMA, command="emulate", config_toml=to_toml(config), arm=str(config.arm), model_sha256="",
            core_sha256="", seed=config.seed, trial=_TRIAL, start_m=(0.0, 0.0), ready_rad=tuple(ready.q_rad.tolist()),
            tip_rotation=tuple(ready.tip_rotation.ravel().tolist()), perception_json="", policy="", world=SIMULATOR,
            world_json=dump_json({"hole_in_task_m": truth.hole_in_task_m}),
        )  # fmt: skip
        self._put(START, encode_record("Start", start), vital=True)

    def moment(self, now: CellMoment) -> None:
        """Show a tick of the cell; most are left out."""
        self._tick, self._now_ns = self._tick + 1, now.time_ns
        if self._tick % POSE_TICKS:
            return
        times = (now.time_ns, now.time_ns, self._tick)
        wrench = WrenchSample(now.force_N, now.torque_Nm, *times)
        joints = JointSample(now.joints_rad, *times)
        told = AppliedCommand(now.joints_rad)
        record = TickRecord(self._tick, now.time_ns, now.deadline_ns, wrench, joints, now.targets_rad, told)
        self._put(TICK, encode_record(TICK.message, record))

    def inserted(self, number: int, truth: Truth) -> None:
        """The peg has newly reached full depth."""
        detail = f"{number}: {truth.depth_m * 1e3:.2f} mm deep, peak force so far {truth.peak_force_N:.1f} N"
        self._put(EVENT, encode_record("Event", EventEntry(tick=self._tick, name="inserted", detail=detail)))

    def _put(self, kind: ChannelKind, payload: bytes, *, vital: bool = False) -> None:
        self._live.put(message_frame(kind.id, self._now_ns, payload), vital=vital)
