"""The way of one control tick through the files, counted by profiling: files entered, calls, changes of file.

    python -m benchmarks.tick_walk                   over the bare ports of the simulated cell, supervised
    python -m benchmarks.tick_walk --rig             the same under all that a rig's run puts over its devices
    python -m benchmarks.tick_walk --emulated        `palpate run --rig` over emulated devices, drivers and all
    python -m benchmarks.tick_walk --rig --walk      also prints the tick, call by call
    python -m benchmarks.tick_walk --rig --checkout ../before --json rig.json

What counts is what ``sys.setprofile`` tells of the loop's own thread: a call is an entry into a Python function of a
palpate source file (a generator's resumption is one; C, libraries and what dataclasses generate are none). A change of
file is a call whose file is not that of the call before it, whoever called whom. A tick is from one outermost
``Clock.sleep_until`` to the next, of the last trial's exploring phase.

Ticks differ: before the first action is chosen nothing is compared with the surface, at an action's end something is
perceived, every fourteenth tick hands a batch to the recorder, devices answer when they do. ``quietest`` is the tick
with the fewest calls, which the figures asked for are of; ``usual`` is the walk that occurs most often.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from benchmarks.house import ROOTS
from benchmarks.tick_setups import Trial, over_emulated_devices, over_simulated_ports

EXPLORING = "EXPLORE"
"""Name of the phase; the task's ``sense`` is called in it."""


@dataclass(frozen=True)
class Call:
    """One entry into a function: how many calls are open around it, its file below the checkout, its name."""

    depth: int
    file: str
    name: str


@dataclass(frozen=True, order=True)
class Figures:
    """What a tick's walk comes to."""

    files: int
    changes: int
    calls: int

    @classmethod
    def of(cls, tick: Sequence[Call]) -> Figures:
        files = [call.file for call in tick]
        return cls(len(set(files)), sum(a != b for a, b in pairwise(files)), len(files))


class Walker:
    """A profiler that cuts what it sees into ticks.

    Attributes:
        ticks: The exploring ticks of the last task that was seen at work.
    """

    def __init__(self, checkout: Path) -> None:
        self.ticks: list[list[Call]] = []
        self._roots = tuple(f"{checkout.resolve()}/{root}/palpate/" for root in ROOTS)
        self._cut = len(f"{checkout.resolve()}/")
        self._files: dict[CodeType, str] = {}
        self._task: object = None
        self._tick: list[Call] | None = None
        self._exploring = False
        self._depth = 0

    def walk(self, trial: Trial) -> None:
        """Run a trial in this thread, profiled."""
        sys.setprofile(self._told)
        try:
            trial()
        finally:
            sys.setprofile(None)

    def _told(self, frame: FrameType, event: str, argument: Any) -> None:
        if event not in ("call", "return"):
            return
        file = self._file(frame.f_code)
        if not file:
            return
        if event == "return":
            self._depth -= 1
            return
        name = frame.f_code.co_name
        if name == "sleep_until" and (frame.f_back is None or frame.f_back.f_code.co_name != name):
            self._next_tick()
        if self._tick is not None:
            if name == "sense":
                self._note_phase(frame.f_locals["self"])
            self._tick.append(Call(self._depth, file, frame.f_code.co_qualname))
        self._depth += 1

    def _next_tick(self) -> None:
        if self._tick is not None and self._exploring:
            self.ticks.append(self._tick)
        self._tick, self._exploring, self._depth = [], False, 0

    def _note_phase(self, task: Any) -> None:
        if task is not self._task:
            # Only the last one counts: before a rig's trial one in the simulator warms up.
            self._task, self.ticks = task, []
        self._exploring = task.phase.name == EXPLORING

    def _file(self, code: CodeType) -> str:
        file = self._files.get(code)
        if file is None:
            path = code.co_filename
            file = self._files[code] = path[self._cut :] if path.startswith(self._roots) else ""
        return file


@dataclass(frozen=True)
class Found:
    """What a trial's exploring ticks come to; ``entered`` are the files of the quietest."""

    mode: str
    quietest: Figures
    usual: Figures
    ticks: int
    walks: list[tuple[Figures, int]]
    entered: list[str]


def found(mode: str, ticks: Sequence[Sequence[Call]]) -> Found:
    """The figures of a trial's ticks."""
    if not ticks:
        raise SystemExit(f"no tick of the phase {EXPLORING} was seen")
    walks = Counter(map(Figures.of, ticks))
    (usual, _), *_ = walks.most_common(1)
    quiet = quietest(ticks)
    return Found(mode, Figures.of(quiet), usual, len(ticks), walks.most_common(), sorted({c.file for c in quiet}))


def quietest(ticks: Iterable[Sequence[Call]]) -> Sequence[Call]:
    """The first tick with the fewest calls."""
    return min(ticks, key=len)


def text(all_of_it: Found) -> str:
    """The figures, for people."""
    lines = [f"{all_of_it.mode}: {all_of_it.ticks} exploring ticks"]
    lines.append(f"{'':<10}{'files':>7}{'changes of file':>17}{'calls':>7}")
    for name, figures in (("quietest", all_of_it.quietest), ("usual", all_of_it.usual)):
        lines.append(f"{name:<10}{figures.files:>7}{figures.changes:>17}{figures.calls:>7}")
    return "\n".join(lines)


def drawn(tick: Sequence[Call]) -> str:
    """A tick, call by call, what is called below who calls."""
    return "\n".join(f"{'  ' * max(call.depth, 0)}{call.name}  {call.file}" for call in tick)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--checkout", type=Path, default=Path(__file__).parent.parent)
    parser.add_argument("--rig", action="store_true", help="the rig's layers over the simulated cell's ports")
    parser.add_argument("--emulated", action="store_true", help="palpate run --rig over emulated devices")
    parser.add_argument("--devices", nargs=2, default=("zebra-nmc", "jr3-can"), metavar=("ARM", "FORCE"))
    parser.add_argument("--walk", action="store_true", help="print the quietest tick, call by call")
    parser.add_argument("--json", type=Path, help="write the figures here too")
    options = parser.parse_args()
    checkout = options.checkout.resolve()
    walker = Walker(checkout)
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        if options.emulated:
            mode = f"emulated {' and '.join(options.devices)}"
            over_emulated_devices(checkout, Path(folder), walker.walk, *options.devices)
        else:
            mode = "rig over simulated ports" if options.rig else "bare simulated ports"
            over_simulated_ports(checkout, Path(folder), walker.walk, rig=options.rig)
    figures = found(mode, walker.ticks)
    if options.walk:
        print(drawn(quietest(walker.ticks)))
    print(text(figures))
    if options.json:
        options.json.write_text(json.dumps(asdict(figures), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
