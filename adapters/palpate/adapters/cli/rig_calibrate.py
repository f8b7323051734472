"""``palpate rig calibrate``."""

import os
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from palpate.adapters.cli.notices import print_grants, say
from palpate.adapters.cli.options import CalibrateOptions
from palpate.adapters.config import CalibrationTable, RigFile, remeasured, write_into
from palpate.adapters.experiments import warm_up
from palpate.adapters.experiments.calibration import (
    Commissioning,
    Estimate,
    hole_picture,
    measure_rest,
    rest_picture,
    touch_picture,
    weigh_picture,
)
from palpate.adapters.files import write_whole
from palpate.adapters.hardware import (
    FaultFile,
    HardwareRig,
    MonotonicClock,
    RigContext,
    find_approach,
    force_sensor_maker,
)
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import ConfigurationError, OutputError, UsageError
from palpate.core.motion import arm_named
from palpate.core.trial import find_ready_pose

STEPS: Final = {
    "rest": "measure the force sensor at rest; nothing moves, nothing may touch the tool",
    "weigh": "lift the tool above the plate and tilt it by up to 25 degrees to all sides; make room, no cable may pull",
    "touch": "press the peg on the plate with up to 7 N at four places 5 mm beside the believed hole",
    "hole": "insert the peg three times; the torque leads it into the hole",
}
_TABLE: Final = CalibrationTable.TABLE


class _LeaveError(Exception):
    """The person has had enough."""


def calibrate(options: CalibrateOptions) -> int:
    """Go through the steps, each confirmed; returns the exit code."""
    options.require("rig", bool(options.rig), "a rig file: palpate rig calibrate --rig FILE")
    if strange := [step for step in options.steps or ("",) if step not in STEPS]:
        raise ConfigurationError("steps", strange[0], f"some of {', '.join(STEPS)}")
    bench = _Bench(options)
    try:
        bench.go()
    except _LeaveError:
        sys.stderr.write("palpate: ended; what was found so far is in the rig file\n")
        return 130
    return 0


class _Bench:
    """One rig, its file, and the person beside it."""

    def __init__(self, options: CalibrateOptions) -> None:
        self._options, self._path = options, Path(options.rig)
        self._file = RigFile.load(self._path)
        arm_named(options.run.arm)
        if options.yes and not self._file.emulated:
            raise UsageError(f"--yes is for emulated rigs only: at {self._file.name} a person confirms each step")
        self._out = Path(options.out) if options.out else self._path.with_name(f"{self._path.stem}-calibration")
        # Steps take minutes: what they find must have a place before the first of them.
        _require_writable(self._path.resolve().parent, "rig")
        if not os.access(self._path, os.W_OK):
            raise OutputError(options.rig, "is to be read only", "make it writable, or name a copy with --rig")
        _require_writable(self._out, "out")
        self._latch: FaultFile | None = None
        if set(options.steps) - {"rest"}:
            self._latch = FaultFile(self._path, options.acknowledge)
        if "hole" in options.steps and "weigh" not in options.steps:
            _require_turn(self._file)

    def go(self) -> None:
        """All steps that are asked for, each when it is confirmed."""
        done = False
        for step in STEPS:
            if step not in self._options.steps or not self._confirmed(step):
                continue
            done = True
            if step == "rest":
                self._rest()
            else:
                self._moved(step)
        if done:
            job = f" --job {self._options.job}" if self._options.job else ""
            say(f"written to {self._path}; next: palpate run --rig {self._path}{job} --policy torque --trials 1")

    def _rest(self) -> None:
        clock = MonotonicClock()
        entry = self._file.force_sensor
        sensor = force_sensor_maker(entry.adapter)(entry.settings, RigContext.of(self._options.run.arm, clock))
        with ExitStack() as opened:
            opened.callback(sensor.close)
            sensor.configure()
            sensor.activate()
            rest, wrenches = measure_rest(clock, sensor, self._options.seconds)
        self._keep(
            "rest",
            {
                "force_sensor.facts": {"noise_N": rest.noise_N.value, "noise_Nm": rest.noise_Nm.value},
                _TABLE: {"force_rate_Hz": rest.rate_Hz},
            },
            rest_picture(wrenches, rest),
            f"noise {rest.noise_N.text('N')}, {rest.noise_Nm.text('N m')}; {rest.rate_Hz:.1f} new samples a second",
        )

    def _moved(self, step: str) -> None:
        """A step that moves the arm. The rig is open for it alone: between steps, keys are a person's answers."""
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
        with (
            HardwareRig(file, config, find_approach(config, ready), self._latch) as rig,
            RealTimeSession(config.real_time) as session,
        ):
            print_grants(session, config)
            commissioning = Commissioning(rig, config, session.loop, lambda text: say(f"{step}: {text}"))
            if step == "weigh":
                self._weigh(commissioning)
            elif step == "touch":
                self._touch(commissioning)
            else:
                self._hole(commissioning, before.calibration.mounting_deg or 0.0, before.calibration.weight_N or 0.0)

    def _weigh(self, commissioning: Commissioning) -> None:
        load, down, means, joint_rate_Hz = commissioning.weigh()
        centre, offset = load.centre_of_mass_m, load.offset
        values = {
            "weight_N": load.weight_N.value, "weight_sd_N": load.weight_N.sd,
            "centre_of_mass_mm": _values(centre, 1e3), "centre_of_mass_sd_mm": _spreads(centre, 1e3),
            "offset_N": _values(offset[:3]), "offset_sd_N": _spreads(offset[:3]),
            "offset_Nm": _values(offset[3:]), "offset_sd_Nm": _spreads(offset[3:]),
            "mounting_deg": load.mounting_deg.value, "mounting_sd_deg": load.mounting_deg.sd,
            "joint_rate_Hz": joint_rate_Hz,
        }  # fmt: skip
        told = "; ".join(f"{axis} {each.text('mm', 1e3)}" for axis, each in zip("xyz", centre, strict=True))
        text = f"weight {load.weight_N.text('N')}; centre of mass {told}; turned by {load.mounting_deg.text('degrees')}"
        self._keep("weigh", {_TABLE: values}, weigh_picture(load, down, means), text)

    def _touch(self, commissioning: Commissioning) -> None:
        touched = commissioning.touch()
        height, stiffness = touched.height_m, touched.stiffness_N_per_m
        values = {
            "plate_mm": height.value * 1e3, "plate_sd_mm": height.sd * 1e3,
            "axial_stiffness_N_per_mm": stiffness.value * 1e-3, "axial_stiffness_sd_N_per_mm": stiffness.sd * 1e-3,
        }  # fmt: skip
        text = f"plate at {height.text('mm', 1e3)}; stiffness {stiffness.text('N/mm', 1e-3)}"
        self._keep("touch", {_TABLE: values}, touch_picture(touched), text)

    def _hole(self, commissioning: Commissioning, turn_deg: float, weight_N: float) -> None:
        x, y, places = commissioning.insert(turn_deg, weight_N)
        values = {"hole_mm": _values((x, y), 1e3), "hole_sd_mm": _spreads((x, y), 1e3)}
        text = f"hole at x {x.text('mm', 1e3)}, y {y.text('mm', 1e3)}"
        self._keep("hole", {_TABLE: values}, hole_picture(places, x, y), text)

    def _keep(self, step: str, tables: Mapping[str, Mapping[str, Any]], picture: bytes, text: str) -> None:
        """Into the rig file at once: a later step may fail."""
        try:
            write_into(self._path, {name: {k: _short(v) for k, v in table.items()} for name, table in tables.items()})
            self._out.mkdir(parents=True, exist_ok=True)
            write_whole(self._out / f"{step}.png", picture)
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
            # Whoever types "no" has not confirmed: anything else is asked again.
            if answer.strip() in ("", "s"):
                return not answer.strip()


def _require_turn(file: RigFile) -> None:
    """The hole is led to by torques, which a turned sensor shows turned."""
    if file.calibration.mounting_deg is None:
        raise ConfigurationError(f"{_TABLE}.mounting_deg", None, "a number, by the step weigh")


def _require_writable(folder: Path, flag: str) -> None:
    """A folder that is there, or one that can be made."""
    there = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        problem = f"cannot be written there ({there} is no writable folder)"
        raise OutputError(str(folder), problem, f"name another folder with --{flag}")


def _values(estimates: tuple[Estimate, ...], scale: float = 1.0) -> tuple[float, ...]:
    return tuple(each.value * scale for each in estimates)


def _spreads(estimates: tuple[Estimate, ...], scale: float = 1.0) -> tuple[float, ...]:
    return tuple(each.sd * scale for each in estimates)


def _short(value: Any) -> Any:
    """To six digits: more are noise."""
    return tuple(map(_short, value)) if isinstance(value, tuple) else float(f"{value:.6g}")
