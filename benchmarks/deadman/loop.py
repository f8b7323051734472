"""The loop, in a process of its own, and how the bench speaks to it."""

from __future__ import annotations

import argparse
import ctypes
import mmap
import select
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from queue import Queue

from benchmarks.deadman.arm import MOVING, NS, adapter_of
from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.rig import RigFile
from palpate.adapters.hardware.real_time import RealTime
from palpate.core.errors import PalpateError
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CONTROL_RATE_HZ, CommandReason, JointCommand

FAR_RAD = 1.2
HANG_S = 1.0
GONE_S = 5.0


def loop(path: str, arm_name: str, note_path: str, start_rad: tuple[float, ...], deadman_ms: float, rt: bool) -> None:
    """Moves the arm until it is killed; says what happened, a line each."""
    wishes = RealTimeConfig(scheduling=rt)
    adapter, clock = adapter_of(RigFile.load(Path(path)), arm_name, wishes, deadman_ms)
    hang = ctypes.PyDLL(None).usleep
    with Path(note_path).open("r+b") as file:
        note = mmap.mmap(file.fileno(), 8)
    sys.stdin.readline()
    with adapter.arm as arm, RealTime(wishes) as granted, granted.loop():
        while True:
            home = adapter.encoder.read().position_rad
            far = JointCommand(
                tuple(
                    q + (FAR_RAD if q < begin else -FAR_RAD) if i in MOVING else q
                    for i, (q, begin) in enumerate(zip(home, start_rad, strict=True))
                )
            )
            start_ns, tick = clock.now_ns(), 0
            print("moving", flush=True)
            try:
                while True:
                    deadline_ns = start_ns + tick * NS // CONTROL_RATE_HZ
                    clock.sleep_until(deadline_ns)
                    sent_ns = time.monotonic_ns()
                    applied = arm.send(far)
                    if applied.reason is CommandReason.STOPPED:
                        raise PalpateError("stopped")
                    note[:] = sent_ns.to_bytes(8, "little")
                    adapter.encoder.read()
                    tick = max(tick + 1, (clock.now_ns() - start_ns) * CONTROL_RATE_HZ // NS)
                    if select.select([sys.stdin], [], [], 0)[0] and sys.stdin.readline():
                        # Without letting go of the interpreter.
                        hang(round(HANG_S * 1e6))
            except PalpateError as error:
                print(f"fault {error}", flush=True)
                free(arm)


def free(arm: ArmCommand) -> None:
    """Make the arm active again. On a busy machine an emulated device may fail meanwhile, and then once more."""
    for attempt in range(5):
        # Where the driver fails, its error comes before its fault.
        time.sleep(0.05 + 0.2 * attempt)
        try:
            if arm.life is Life.FAULTED:
                arm.acknowledge_fault()
            if arm.life is Life.ACTIVE:
                arm.deactivate()
            arm.activate()
            return
        except PalpateError as error:
            print(f"once more: {error}", file=sys.stderr, flush=True)
    raise SystemExit("the arm cannot be made active")


class Loop:
    """That process, seen from the bench."""

    def __init__(self, rig: Path, arm: str, folder: Path, start: str, options: argparse.Namespace) -> None:
        self.note = Path(tempfile.mkstemp(dir=folder)[1])
        self.note.write_bytes(bytes(8))
        words = ["--rig", str(rig), "--arm", arm, "--note", str(self.note), "--deadman-ms", str(options.deadman_ms)]
        call = [sys.executable, "-m", "benchmarks.deadman.loop", *words, f"--start={start}"]
        call += ["--rt"] if options.rt else []
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(call, stdin=pipe, stdout=pipe, text=True, bufsize=1)
        self.begun = False
        self.arms: list[Path] = []
        self.lines: Queue[str] = Queue()
        threading.Thread(target=self.listen, daemon=True).start()

    def say(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.put(line.strip())
        self.lines.put("")

    def until_moving(self) -> str:
        """What it said before it moved."""
        if not self.begun:
            self.begun = True
            self.say()
        said = ""
        while (line := self.lines.get()) != "moving":
            if not line:
                raise SystemExit(f"the loop has ended: {said}")
            said = line
        return said

    def forget(self) -> None:
        """What it said of trips for which nobody asked: on a busy machine they come."""
        while not self.lines.empty():
            if not self.lines.get():
                raise SystemExit("the loop has ended")

    def last_set_ns(self) -> int:
        return int.from_bytes(self.note.read_bytes(), "little")

    def note_arms(self) -> None:
        number = self.process.pid
        begun = Path(f"/proc/{number}/task/{number}/children")
        self.arms += [Path("/proc") / child for child in (begun.read_text().split() if begun.exists() else [])]

    def kill(self) -> None:
        """End it, and wait until the arm's process has found out and has gone too."""
        self.note_arms()
        self.process.kill()
        self.process.wait()
        end_s = time.monotonic() + GONE_S
        while any(arm.exists() for arm in self.arms):
            if time.monotonic() > end_s:
                raise SystemExit(f"the arm's process is left behind: {self.arms}")
            time.sleep(0.01)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for word in ("--rig", "--arm", "--note", "--start"):
        parser.add_argument(word, required=True)
    parser.add_argument("--deadman-ms", type=float, required=True)
    parser.add_argument("--rt", action="store_true")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    start_rad = tuple(map(float, options.start.split(",")))
    loop(options.rig, options.arm, options.note, start_rad, options.deadman_ms, options.rt)


if __name__ == "__main__":
    main()
