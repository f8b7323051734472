"""``palpate rig calibrate``."""

import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from palpate.adapters.cli.notices import print_grants, say
from palpate.adapters.cli.options import CalibrateOptions
from palpate.adapters.config import CalibrationTable, RigFile, remeasured, write_into
from palpate.adapters.experiments import warm_up
from palpate.adapters.experiments.calibration import Commissioning, Estimate
from palpate.adapters.hardware import FaultFile, HardwareRig, find_approach
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import ConfigurationError, OutputError, UsageError
from palpate.core.motion import arm_named
from palpate.core.trial import find_ready_pose

STEPS: Final = {
    "payload": "lift the tool above the plate and tilt it by up to 25 degrees to all sides; no cable may pull",
    "plate": "press the peg on the plate with up to 7 N at four places 5 mm away from the believed hole",
    "hole": "insert the peg three times; the torque leads it into the hole",
}
_TABLE: Final = CalibrationTable.TABLE


class _LeaveError(Exception):
    """The person ends the calibration."""


def calibrate(options: CalibrateOptions) -> int:
    """Go through the steps, each confirmed; returns the exit code."""
    options.require("rig", bool(options.rig), "a rig file: palpate rig calibrate --rig FILE")
    if unknown := [step for step in options.steps or ("",) if step not in STEPS]:
        raise ConfigurationError("steps", unknown[0], f"some of {', '.join(STEPS)}")
    try:
        _Calibration(options).run()
    except _LeaveError:
        sys.stderr.write("palpate: ended; what was found so far is in the rig file\n")
        return 130
    return 0


class _Calibration:
    """One rig, its file, and the person next to it."""

    def __init__(self, options: CalibrateOptions) -> None:
        self._options, self._path = options, Path(options.rig)
        file = RigFile.load(self._path)
        arm_named(options.run.arm)
        if options.yes and not file.emulated:
            raise UsageError(f"--yes is for emulated rigs only: at {file.name} a person confirms each step")
        # Steps take minutes: what they find must have a place before the first of them.
        if not (os.access(self._path, os.W_OK) and os.access(self._path.resolve().parent, os.W_OK)):
            raise OutputError(options.rig, "cannot be written", "make file and folder writable, or name a copy")
        self._latch = FaultFile(self._path, options.acknowledge)
        if "hole" in options.steps and "payload" not in options.steps:
            _require_turn(file)

    def run(self) -> None:
        """Do every step that is asked for, each when it is confirmed."""
        done = [step for step in STEPS if step in self._options.steps and self._confirmed(step) and self._done(step)]
        if done:
            job = f" --job {self._options.job}" if self._options.job else ""
            say(f"written to {self._path}; next: palpate run --rig {self._path}{job} --policy torque --trials 1")

    def _done(self, step: str) -> bool:
        """Do a step. The rig is open for it alone: between steps, keys are a person's answers."""
        before = RigFile.load(self._path)
        if step == "hole":
            _require_turn(before)
        run = self._options.run
        config = remeasured(run, before.calibration.run_settings(run.tool), before.facts.noise())
        # As the sensor is mounted: how it is turned is what is measured.
        accepted = self._options.accept_kinematics
        file = replace(before, calibration=CalibrationTable(), accept_kinematics=accepted)
        ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
        warm_up(config, ready)
        rig = HardwareRig(file, config, find_approach(config, ready), self._latch)
        session = RealTimeSession(config.real_time)
        commissioning = Commissioning(rig, config, session.loop, lambda text: say(f"{step}: {text}"))
        if step == "payload":
            # Before any device is open.
            commissioning.plan_payload()
        with rig, session:
            print_grants(session, config)
            if step == "payload":
                self._payload(commissioning)
            elif step == "plate":
                self._plate(commissioning)
            else:
                self._hole(commissioning, before.calibration)
        return True

    def _payload(self, commissioning: Commissioning) -> None:
        load = commissioning.payload()
        centre = zip("xyz", load.centre_of_mass_m, strict=True)
        told = "; ".join(f"{axis} {each.text('mm', 1e3)}" for axis, each in centre)
        text = f"weight {load.weight_N.text('N')}; centre of mass {told}; turned by {load.mounting_deg.text('degrees')}"
        values = {
            "weight_N": load.weight_N.value,
            "centre_of_mass_mm": _values(load.centre_of_mass_m, 1e3),
            "mounting_deg": load.mounting_deg.value,
        }
        self._keep("payload", values, text)

    def _plate(self, commissioning: Commissioning) -> None:
        height, stiffness = commissioning.plate()
        text = f"plate at {height.text('mm', 1e3)}; stiffness {stiffness.text('N/mm', 1e-3)}"
        values = {"plate_mm": height.value * 1e3, "axial_stiffness_N_per_mm": stiffness.value * 1e-3}
        self._keep("plate", values, text)

    def _hole(self, commissioning: Commissioning, known: CalibrationTable) -> None:
        x, y = commissioning.insert(known.mounting_deg or 0.0, known.weight_N or 0.0)
        text = f"hole at x {x.text('mm', 1e3)}, y {y.text('mm', 1e3)}"
        self._keep("hole", {"hole_mm": _values((x, y), 1e3)}, text)

    def _keep(self, step: str, values: Mapping[str, Any], text: str) -> None:
        """Write into the rig file at once: a later step may fail."""
        try:
            write_into(self._path, {_TABLE: {name: _short(value) for name, value in values.items()}})
        finally:
            # Where the disk is full, too: it took minutes to find.
            say(f"{step}: {text}")

    def _confirmed(self, step: str) -> bool:
        sys.stderr.write(f"{step}: {STEPS[step]}\n")
        if self._options.yes:
            return True
        while True:
            sys.stderr.write("Enter does it, s leaves it out, q ends: ")
            sys.stderr.flush()
            answer = sys.stdin.readline()
            if not answer or answer.strip() == "q":
                raise _LeaveError
            # Anything else, such as "no", does not confirm: it is asked again.
            if answer.strip() in ("", "s"):
                return not answer.strip()


def _require_turn(file: RigFile) -> None:
    """The torque leads to the hole, and a turned sensor gives it turned."""
    if file.calibration.mounting_deg is None:
        raise ConfigurationError(f"{_TABLE}.mounting_deg", None, "a number, by the step payload")


def _values(estimates: tuple[Estimate, ...], scale: float) -> tuple[float, ...]:
    return tuple(each.value * scale for each in estimates)


def _short(value: Any) -> Any:
    """To six digits: more are noise."""
    return tuple(map(_short, value)) if isinstance(value, tuple) else float(f"{value:.6g}")
