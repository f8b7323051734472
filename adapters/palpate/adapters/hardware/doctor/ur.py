"""An arm of Universal Robots. Nothing is switched on here."""

from collections.abc import Sequence
from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import at_rate, rate_Hz, spread_of
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.ur import judged
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.drivers.ur import UrArm

_CABLE: Final = "connect controller and computer directly, or through one switch that carries nothing else"
_OTHER_WORK: Final = "end other work on this computer; ask for real-time scheduling"
_FRESH_SHARE: Final = 0.99


def examine_ur(arm: UrArm, context: RigContext, seconds: float, notes: Notebook) -> None:
    """Who the controller is, what payload it is set to, how its data come; its program is not led."""
    if arm.hello is not None:
        notes.fact("controller", f"PolyScope {arm.hello.version}, robot {arm.hello.serial}")
    settings = arm.settings
    if arm.seen is not None:
        notes.fact("payload", f"{arm.seen.payload_kg:g} kg at {arm.seen.payload_cog_m} m from the flange")
    notes.fact("tool centre point", f"{arm.tcp_offset} from the flange, m and rad")
    for line in judged(arm, context):
        notes.ok(line)
    if not context.arm.calibration:
        remedy = "save the controller's own and name it in the rig file: [arm] calibration = FILE"
        notes.note("the model of the arm is nominal", remedy)
    clock = context.clock
    begun: list[int] = []
    late_ns: list[int] = []
    fresh: list[bool] = []
    ages_ns: list[int] = []
    angles: list[tuple[float, ...]] = []

    def turn() -> None:
        begun.append(clock.now_ns())
        found = arm.cycle()
        fresh.append(all(found.is_fresh))
        ages_ns.append(clock.now_ns() - found.time_ns)
        angles.append(found.position_rad)

    wanted_Hz = 1.0 / settings.period_s
    try:
        at_rate(clock, wanted_Hz, seconds, turn, late_ns)
    finally:
        notes.fact("state", arm.state.value if arm.fault is None else f"{arm.state.value}: {arm.fault}")
    limits = zip(angles[-1], settings.lower_rad, settings.upper_rad, strict=True)
    rows = tuple((str(i + 1), f"{q:+.4f}", f"{low:.2f} to {high:.2f}") for i, (q, low, high) in enumerate(limits))
    notes.table(("joint", "angle (rad)", "limits (rad)"), rows)
    if (spread := spread_of(ages_ns)) is not None:
        notes.fact("age of the angles", str(spread))
    judge_angles(fresh, rate_Hz(begun), wanted_Hz, notes)


def judge_angles(fresh: Sequence[bool], got_Hz: float, wanted_Hz: float, notes: Notebook) -> None:
    """Whether cycles came at their rate and each brought new angles; none waits for data, so a late one is ours."""
    told = f"{sum(fresh)} of {len(fresh)} cycles brought new angles, at {got_Hz:.1f} of {wanted_Hz:.1f} Hz"
    all_fresh = sum(fresh) >= _FRESH_SHARE * len(fresh)
    remedy = f"{_OTHER_WORK if all_fresh else _CABLE}; or [arm] divider = 2, {CONTROL_RATE_HZ / 2:g} Hz"
    notes.judge(all_fresh and got_Hz > 0.97 * wanted_Hz, told, told, remedy)
