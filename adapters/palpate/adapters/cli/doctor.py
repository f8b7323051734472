"""``palpate doctor``."""

import sys
from dataclasses import replace
from pathlib import Path

from palpate.adapters.cli.options import DoctorOptions
from palpate.adapters.config import RigFile, overlay, read_job
from palpate.adapters.hardware import FaultFile, MonotonicClock, RigContext
from palpate.adapters.hardware.doctor import (
    Examination,
    FindingsSection,
    Level,
    Person,
    System,
    Wishes,
    section_text,
    summary_text,
)
from palpate.core.job import ToolConfig


class _Terminal(Person):
    """The person at the terminal. Questions go to the error stream: the other one may be kept in a file."""

    def ask(self, question: str) -> str | None:
        self.tell(question)
        return sys.stdin.readline() or None

    def tell(self, text: str) -> None:
        sys.stderr.write(text)
        sys.stderr.flush()


def doctor(options: DoctorOptions) -> int:
    """Examine a rig and print the report; 0 if all is well, 1 if something is wrong, 130 after Ctrl-C."""
    options.require("rig", bool(options.rig), "a rig file: palpate doctor --rig FILE")
    file = RigFile.load(Path(options.rig))
    options.require("acknowledge", options.move or not options.acknowledge, "nothing without --move: nothing moves")
    begin = FaultFile(Path(options.rig), options.acknowledge).begin if options.move else str
    wishes = Wishes(options.seconds, _Terminal() if options.push else None, options.move, begin)
    # Without --move nothing moves by the model, so it is compared and no more.
    context = replace(
        RigContext.of(options.arm or file.arm_model(), MonotonicClock()),
        tool=overlay(ToolConfig(), read_job(file.job)["tool"]) if file.job else None,
        accept_kinematics=options.accept_kinematics or file.emulated or not options.move,
    )
    examination = Examination(file, context, wishes, System())
    sections: list[FindingsSection] = []
    try:
        for section in examination.sections():
            sections.append(section)
            _print(section_text(section))
    except KeyboardInterrupt:
        sys.stderr.write("\npalpate: stopped; every device is closed\n")
        return 130
    _print(summary_text(sections))
    return 1 if any(section.count(Level.WRONG) for section in sections) else 0


def _print(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()
