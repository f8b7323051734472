"""How a replay ended, and every call at the ports, held against the recorded ones."""

from typing import Final

from palpate.adapters.log import BY_CORE, BY_POLICY, BY_PORT, TickRecord, raised_by
from palpate.adapters.replay.compare import Beginning
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.adapters.replay.tape import Tape, TapeEndError
from palpate.core.errors import DeviceError
from palpate.core.ports import SENSOR_FRAME, WrenchKind
from palpate.core.trial import TrialReport

_STILL_RUNNING: Final = "still running"


def compare_ending(tape: Tape, rebuilt: Rebuilt, error: BaseException | None, failed_port: str) -> str:
    """Hold the way in which the trial ended against the recorded one; returns what is to be said of it, if anything.

    Args:
        error: What ended the replay, if it did not end by itself.
        failed_port: The port whose call failed then; empty for none.
    """
    end = tape.log.end
    tick, differences = tape.tick, tape.differences
    if isinstance(error, TapeEndError):
        return _compare_tape_end(tape)
    if error is not None:
        told, now = "" if end is None else f"{end.error}: {end.text}", f"{type(error).__name__}: {error}"
        if told != now:
            differences.add(tick, "/end", "error", told or None, now)
        elif end is not None:
            now = raised_by(error, failed_port)
            if now != end.raised_by:
                differences.add(tick, "/end", "raised_by", end.raised_by or None, now)
    elif tape.sends.left:
        outcome = rebuilt.task.report.outcome
        now = "" if outcome is None else outcome.value
        recorded = _STILL_RUNNING if end is None else f"{end.ticks} ticks"
        differences.add(tick, "/end", "ticks", recorded, f"{tick + 1} ticks, {now}")
    elif end is not None and end.raised_by == BY_POLICY and rebuilt.recorded_decisions:
        return f"the policy ended the recording with {end.error}: {end.text}"
    elif end is not None and (end.error or end.text or end.raised_by):
        differences.add(tick, "/end", "error", f"{end.error}: {end.text}", None)
    return ""


def _compare_tape_end(tape: Tape) -> str:
    """The core would go on where the recorded samples end."""
    end, tick, differences = tape.log.end, tape.tick, tape.differences
    last = len(tape.log.ticks) - 1
    if end is None:
        return f"the log ends at tick {last}, before the trial did"
    if end.error and end.raised_by == BY_CORE:
        differences.add(tick, "/end", "error", f"{end.error}: {end.text}", _STILL_RUNNING)
    elif end.raised_by == BY_PORT:
        # The call that failed would have failed again.
        differences.add(tick, "/end", "raised_by", end.raised_by, None)
    elif end.error and not end.outcome:
        return f"the recording was ended by {end.error} at tick {last}"
    else:
        differences.add(tick, "/end", "outcome", end.outcome, _STILL_RUNNING)
    return ""


def is_torn(last: TickRecord | None) -> bool:
    """Whether the log's last tick was under way: then it is open how much of it was done."""
    return last is not None and last.joints is not None and last.asked_rad is None


def compare_calls(tape: Tape, report: TrialReport, *, refused: bool) -> None:
    """Hold all port calls, in order, against the recorded ones, and each wrench against what the core takes it for."""
    differences = tape.differences
    if not differences.count:
        tape.load_rest()
    parted = tape.order.first_difference(whole=tape.log.end is not None and not differences.count)
    if parted is not None:
        tick, told, made = parted
        differences.add(max(tick, 0), "/call", "port call", told or None, made or None)
    if tape.claimed_tick is not None and not tape.log.start.derived_from:
        differences.add(tape.claimed_tick, "/tick", "counterfactual", True, False)
    odd = tape.odd_tick
    # A trial that ends with its first tick, by an error, has refused it.
    if (
        odd is not None
        and not (refused and odd == 0 == tape.tick)
        and not any(event.name in ("trip", "end") and event.tick <= odd + 1 for event in report.events)
    ):
        now = f"{WrenchKind.RAW.value}, frame {SENSOR_FRAME!r}, as the core takes it"
        differences.add(odd, "/tick", "wrench", "of another kind or frame", now)


def compare_latch(tape: Tape, cause: str, error: BaseException | None) -> None:
    """Hold what keeps the rig still against the recorded trip, or the device's error that was raised as recorded."""
    trips = (event.detail for event in tape.log.events if event.name == "trip")
    told = next(trips, str(error) if isinstance(error, DeviceError) else "")
    if told != cause:
        # A trip's text holds rounded numbers, which another processor may round otherwise.
        gross = bool(told) is not bool(cause)
        tape.differences.add(tape.tick, "/end", "latch", told or None, cause or None, gross=gross)


def compare_observed(tape: Tape, beginning: Beginning, error: BaseException | None) -> None:
    """Hold what observers of the loop are told against the log: that a trial begins, and which port's call failed."""
    if tape.tick >= 0 and not beginning.held:
        tape.differences.add(0, "/start", "begun", True, False)
    failed = (call.port for call in tape.log.calls if call.error and call.call in ("read", "send"))
    # What comes from outside as a tick begins ends the tape at its clock: no port was being called then.
    between = isinstance(error, TapeEndError) and error.port == "clock"
    told = "" if between else next(failed, "")
    if (between or isinstance(error, DeviceError)) and told != beginning.calling:
        tape.differences.add(tape.tick, "/call", "failed port", told, beginning.calling)
