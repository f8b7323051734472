"""``palpate gap``."""

from collections.abc import Iterator
from math import hypot
from pathlib import Path
from typing import Final

from palpate.adapters.cli.notices import say
from palpate.adapters.cli.options import GapOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import literal
from palpate.adapters.log import aligned
from palpate.adapters.replay import KNOBS, WRENCH_AXES, Gap, find_logs, gap_of, gaps_of
from palpate.core.errors import UsageError
from palpate.core.ports import new_file, require_no_file

_ROUNDS: Final = 20
"""Of a fit, about."""

_SOFTER: Final = "such a cell reads softer than it is"
_DOUBTS: Final = {
    "loop": ("loop that came late", _SOFTER),
    "devices": ("devices that came late", _SOFTER),
    "hole": ("pegs that sank and were not inserted", "nobody knows where the hole was"),
}
"""Of each reason to doubt a log which logs these are, and what is wrong with them."""


def gap(options: GapOptions) -> int:
    """Fit, report and save; returns the exit code."""
    if not options.logs:
        raise UsageError("palpate gap needs logs, folders with logs, or patterns in quotes")
    if options.out:
        require_no_file(Path(options.out))
    with progress(_ROUNDS * (4 if options.reference else 1), "round", passing=True) as bar:
        paths, other = find_logs(options.logs)[: options.most], None
        if options.reference:
            found, other = gaps_of(paths, find_logs([options.reference])[: options.most], bar.update)
        else:
            found = gap_of(paths, bar.update)
    say("\n".join(_report(found)))
    if other:
        say("\n".join([*_doubted(other), f"{other.logs} trials of {options.reference}"]))
        sd = hypot(found.wrench_late_sd_ms, other.wrench_late_sd_ms)
        later = f"{found.cycle_late_ms - other.cycle_late_ms:.1f} ± {2.0 * sd:.2g} ms later"
        say(f"wrenches come {later} than in {options.reference}, where it is {other.wrench_late_ms:.1f} ms")
        left = f"{other.after.wrench[2]:.2g} N along the tool are left there, {found.after.wrench[2]:.2g} N here"
        say(f"friction, stiffnesses and damping are those of both sets of logs together: {left}")
    if options.out:
        with new_file(Path(options.out)) as passing:
            passing.write_text("".join(_toml(found)), encoding="utf-8")
        say(f"saved in {options.out}: palpate train --config {options.out}")
    return 0


def _report(found: Gap) -> Iterator[str]:
    """What is doubted; axis by axis; then what was fitted."""
    yield from _doubted(found)
    units = ("N",) * 3 + ("N m",) * 3
    rows = [["axis", "as configured", "fitted", "unit"]]
    for axis, unit, before, after in zip(WRENCH_AXES, units, found.before.wrench, found.after.wrench, strict=True):
        rows.append([axis, f"{before:.3g}", f"{after:.3g}", unit])
    joints = zip(found.before.joints_rad * 1e3, found.after.joints_rad * 1e3, strict=True)
    for joint, (before, after) in enumerate(joints, start=1):
        rows.append([f"joint {joint}", f"{before:.3g}", f"{after:.3g}", "mrad"])
    yield f"recorded minus simulated, root mean square over {found.logs} trials, offsets in time taken out"
    yield aligned(rows)
    late = f"wrenches by {found.wrench_late_ms:.1f} ± {2.0 * found.wrench_late_sd_ms:.2g} ms"
    yield f"behind the simulated cell: {late}, joints by {found.joints_late_ms:.1f} ms"
    yield "this is the sum over command, arm, sensor and wires: what a policy meets"
    if found.lag_ms:
        yield f"{found.lag_ms:.0f} ms of both are a lag: the arm smoothes its set-points, and is driven so"
    yield f"noise in free air: {found.noise_N:.3g} N, {found.noise_Nm:.3g} N m"
    for number, (knob, value, sd) in enumerate(zip(KNOBS[:-1], found.values, found.sds, strict=False)):
        doubt = "" if found.known(number) or not knob.of_cell else "; not determined: left as configured"
        yield f"{knob.name}: {value:.4g} ± {2.0 * sd:.2g}{doubt}"


def _doubted(found: Gap) -> Iterator[str]:
    for why, count in found.doubted.items():
        which, reason = _DOUBTS[why]
        yield f"{count} logs of {which}, left out if there are others: {reason}"


def _toml(found: Gap) -> Iterator[str]:
    for name, table in found.settings["cell"].items():
        yield f"[cell.{name}]\n"
        yield from (f"{key} = {literal(value)}\n" for key, value in table.items())
