"""The ``palpate rig calibrate`` command."""

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from palpate.adapters.cli.notices import command, say
from palpate.adapters.cli.options import CalibrateOptions
from palpate.adapters.config import CalibrationTable, RigFile, remeasured, write_into
from palpate.adapters.experiments import note, warm_up
from palpate.adapters.experiments.calibration import Commissioning
from palpate.adapters.hardware import FaultFile, HardwareRig, find_approach
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import ConfigurationError, OutputError, UsageError
from palpate.core.motion import arm_named
from palpate.core.supervision import limits_line
from palpate.core.trial import find_ready_pose

STEPS: Final = {
    "payload": "lift the tool 100 mm above the hole and tilt it by up to 25 degrees; keep its cables slack",
    "plate": "press the peg on the plate with up to 7 N at four points 5 mm from the nominal hole",
    "hole": "insert the peg three times, guided by the torque",
}
_TABLE: Final = CalibrationTable.TABLE


class _LeaveError(Exception):
    """The operator has ended the calibration."""


def calibrate(options: CalibrateOptions) -> int:
    """Perform the confirmed steps; return the exit code."""
    options.require("rig", bool(options.rig), "a rig file: palpate rig calibrate --rig FILE")
    if unknown := [step for step in options.steps or ("",) if step not in STEPS]:
        raise ConfigurationError("steps", unknown[0], f"some of {', '.join(STEPS)}")
    path = Path(options.rig)
    file = RigFile.load(path)
    arm_named(options.run.arm)
    if options.yes and not file.emulated:
        raise UsageError(f"--yes is for emulated rigs only: on {file.name} a person confirms each step")
    # Steps take minutes, so the rig file must be writable before the first step.
    if not (os.access(path, os.W_OK) and os.access(path.resolve().parent, os.W_OK)):
        raise OutputError(options.rig, "cannot be written", "make file and folder writable, or name a copy")
    latch = FaultFile(path, options.acknowledge)
    if "hole" in options.steps and "payload" not in options.steps:
        _require_turn(file)
    done = False
    try:
        for step in (step for step in STEPS if step in options.steps):
            if _confirmed(step, yes=options.yes):
                _do(step, options, path, latch)
                done = True
    except _LeaveError:
        sys.stderr.write("palpate: ended; finished steps are in the rig file\n")
        return 130
    if done:
        job = ["--job", options.job] if options.job else []
        say(f"written to {path}; next: {command('run', '--rig', path, *job, '--policy', 'torque', '--trials', 1)}")
    return 0


def _do(step: str, options: CalibrateOptions, path: Path, latch: FaultFile) -> None:
    """Perform a step and write its result. Closing the rig between steps frees the keyboard for prompts."""
    before = RigFile.load(path)
    known = before.calibration
    if step == "hole":
        _require_turn(before)
    config = remeasured(options.run, known.run_settings(options.run.tool), before.facts.noise())
    # The wrench stays in the sensor's own axes, because the payload step measures the mounting angle.
    file = replace(before, calibration=CalibrationTable(), accept_kinematics=options.accept_kinematics)
    ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
    warm_up(config, ready)
    rig = HardwareRig(file, config, find_approach(config, ready), latch)
    session = RealTimeSession(config.real_time)
    commissioning = Commissioning(rig, config, session.loop, lambda text: say(f"{step}: {text}"))
    if step == "payload":
        # The poses are planned before any device is opened.
        commissioning.plan_payload()
    with rig, session:
        for line in (*session.request_results, limits_line(config.supervision, config.task)):
            note(str(line))
        values, text = _measured(step, commissioning, known)
    short = {name: _short(value) for name, value in values.items()}
    try:
        # The result is written at once, because a later step may fail.
        write_into(path, _TABLE, short)
    finally:
        # The result is also printed if the disk is full, because the step took minutes.
        say(f"{step}: {text}")


def _measured(step: str, commissioning: Commissioning, known: CalibrationTable) -> tuple[dict[str, Any], str]:
    """Return a step's result: the values for the rig file, and a description."""
    if step == "payload":
        load = commissioning.payload()
        centre = "; ".join(
            f"{axis} {each.text('mm', 1e3)}" for axis, each in zip("xyz", load.centre_of_mass_m, strict=True)
        )
        values = {
            "weight_N": load.weight_N.value,
            "centre_of_mass_mm": tuple(each.value * 1e3 for each in load.centre_of_mass_m),
            "mounting_deg": load.mounting_deg.value,
        }
        turn = load.mounting_deg.text("degrees")
        return values, f"weight {load.weight_N.text('N')}; centre of mass {centre}; mounting angle {turn}"
    if step == "plate":
        height, stiffness = commissioning.plate()
        values = {"plate_mm": height.value * 1e3, "axial_stiffness_N_per_mm": stiffness.value * 1e-3}
        return values, f"plate at {height.text('mm', 1e3)}; stiffness {stiffness.text('N/mm', 1e-3)}"
    x, y = commissioning.insert(known.mounting_deg or 0.0, known.weight_N or 0.0)
    return {"hole_mm": (x.value * 1e3, y.value * 1e3)}, f"hole at x {x.text('mm', 1e3)}, y {y.text('mm', 1e3)}"


def _confirmed(step: str, *, yes: bool) -> bool:
    sys.stderr.write(f"{step}: {STEPS[step]}\n")
    while not yes:
        sys.stderr.write("Press Enter to start, s to skip this step, q to quit: ")
        sys.stderr.flush()
        answer = sys.stdin.readline()
        if not answer or answer.strip() == "q":
            raise _LeaveError
        # Any other answer, such as "no", is not a confirmation, so the prompt is repeated.
        if answer.strip() in ("", "s"):
            return not answer.strip()
    return True


def _require_turn(file: RigFile) -> None:
    """Require the sensor's mounting angle, because the torque guides the tool to the hole."""
    if file.calibration.mounting_deg is None:
        raise ConfigurationError(f"{_TABLE}.mounting_deg", None, "a number, by the step payload")


def _short(value: Any) -> Any:
    """Round to six significant digits, because further digits are noise."""
    return tuple(map(_short, value)) if isinstance(value, tuple) else float(f"{value:.6g}")
