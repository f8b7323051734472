"""The ``palpate rig doctor`` command."""

import sys
from dataclasses import replace
from pathlib import Path

from palpate.adapters.cli.notices import command
from palpate.adapters.cli.options import DoctorOptions
from palpate.adapters.config import RigFile, overlay, read_job
from palpate.adapters.hardware import FaultFile, MonotonicClock, RigContext
from palpate.adapters.hardware.doctor import DeviceReport, Examination, Level, Person, summary_text
from palpate.core.job import ToolConfig


class _Terminal(Person):
    """Operator at the terminal. Questions are printed to standard error, because the report may be redirected."""

    def ask(self, question: str) -> str | None:
        self.notify(question)
        return sys.stdin.readline() or None

    def notify(self, text: str) -> None:
        sys.stderr.write(text)
        sys.stderr.flush()


def doctor(options: DoctorOptions) -> int:
    """Check a rig and print the report; return 0 if there are no problems, 1 if there are, 130 after Ctrl-C."""
    options.require("rig", bool(options.rig), "a rig file: palpate rig doctor --rig FILE")
    options.require(
        "acknowledge", options.move or not options.acknowledge, "left out without --move, because nothing moves"
    )
    path = Path(options.rig)
    file = RigFile.load(path)
    before_move = FaultFile(path, options.acknowledge).begin if options.move else str
    # Without --move, the model is used only for comparison, not for motion.
    context = replace(
        RigContext.of(options.arm or file.arm_model(), MonotonicClock(None, file.real_time_factor)),
        tool=overlay(ToolConfig(), read_job(file.job)["tool"]) if file.job else None,
        accept_kinematics=options.accept_kinematics or file.emulated or not options.move,
    )
    reports: list[DeviceReport] = []
    try:
        person = _Terminal() if options.push else None
        examination = Examination(file, context, options.seconds, person, move=options.move, before_move=before_move)
        for report in examination.reports():
            reports.append(report)
            _print(report.text())
    except KeyboardInterrupt:
        sys.stderr.write("\npalpate: stopped; every device is closed\n")
        return 130
    wrong = any(report.count(Level.WRONG) for report in reports)
    _print(summary_text(reports) + ("" if wrong else f"next: {_next(options)}\n"))
    return int(wrong)


def _next(options: DoctorOptions) -> str:
    doctor = ("rig", "doctor", "--rig", options.rig)
    if not options.push and not options.move:
        return f"{command(*doctor, '--push')}, with a person at the tool"
    return command("rig", "calibrate", "--rig", options.rig) if options.move else command(*doctor, "--move")


def _print(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()
