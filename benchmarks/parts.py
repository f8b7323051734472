"""Random parts as a user would have them, with the verdict of `palpate plan` and the results of its task and policy.

    python -m benchmarks.parts --parts 60 --seed 1 --out parts.jsonl
    python -m benchmarks.parts --parts 60 --seed 1 --out parts.jsonl --shapes     in six degrees of freedom
    python -m benchmarks.parts --parts 60 --seed 1 --only plan                    nothing is simulated

Each part is a job, with nothing set by hand. The specified friction is 0.2, 0.4 or 0.6, the next value above the true
friction. The depth tolerance is 0.2 mm (0.5 with --shapes), or the minimum that `plan` requires, rounded up to tenths.
The heading of the tilt is drawn once per part. The first trial of a learner is for training and does not count. The
oracle knows the hole; if it fails, one in six degrees of freedom also knows the orientation. It stops at a failure.

Parts are rejected if the uncertainty exceeds the diameter, the depth exceeds 5 diameters, the clearance exceeds 5 % of
the diameter, the tool is lighter than a plastic peg, or the tool exceeds 1 kg on a Zebra Zero. With --shapes, the
limits are a depth of 3 sizes and a clearance of 2 % of the size.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from math import ceil, pi
from typing import Any, Final

import numpy as np

from benchmarks.common import Cell, parser_of, share, sweep, table
from palpate.adapters.config import RunConfig, compose, overlay, verdict_on
from palpate.adapters.experiments.planning import run_series, untrue
from palpate.core.errors import ConfigurationError
from palpate.core.job import DEVIATIONS, SIDES, Verdict
from palpate.simulation.work_cell import valid

ARMS: Final = ("zebra-zero", "ur3", "ur5", "ur10", "panda", "xarm7")
SHAPES: Final = ("round", *SIDES)
PLATE_MRAD: Final = 17.5
"""Tilt of the plate in six degrees of freedom, in any direction. The rest of the tilt is that of the grip."""
KG_PER_MM3: Final = 1.2e-6
"""Density of a plastic."""
ORACLES: Final = (("insertion", "oracle"), ("insertion-6dof", "oracle-pose"))
Part = dict[str, Any]


def drawn(seed: int, parts: int, shapes: bool) -> tuple[list[Part], Counter[str]]:
    """Draw parts, and count the rejected ones by reason."""
    rng, kept, rejected = np.random.default_rng([seed, shapes]), list[Part](), Counter[str]()
    while len(kept) < parts:
        part = (_shape if shapes else _round)(rng, len(kept))
        if reason := _rejected(part, shapes):
            rejected[reason] += 1
        else:
            kept.append({**part, "id": len(kept), "seed": 1000 * seed + len(kept)})
    return kept, rejected


def _log(rng: np.random.Generator, least: float, most: float) -> float:
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def _round(rng: np.random.Generator, number: int) -> Part:
    return {
        "shape": "round", "arm": str(rng.choice(ARMS)), "size_mm": round(_log(rng, 4.0, 65.0), 1),
        "clearance_mm": round(_log(rng, 0.008, 0.3), 3), "depth_mm": round(rng.uniform(5.0, 40.0)),
        "friction": round(rng.uniform(0.08, 0.6), 2), "kg": round(_log(rng, 0.1, 2.0), 2),
        "noise": round(_log(rng, 0.3, 4.0), 1), "off_mm": round(rng.uniform(0.5, 5.0), 1),
        "tilt_mrad": round(rng.uniform(0.3, 6.0), 1), "stiffness": round(_log(rng, 0.3, 3.0), 2),
        "chamfer_mm": 0.5 * int(rng.integers(2)), "yaw_deg": 0.0,
    }  # fmt: skip


def _shape(rng: np.random.Generator, number: int) -> Part:
    return {
        "shape": SHAPES[number % len(SHAPES)], "arm": str(rng.choice(ARMS)), "size_mm": round(_log(rng, 10.0, 60.0), 1),
        "clearance_mm": round(_log(rng, 0.02, 0.2), 3), "depth_mm": round(rng.uniform(7.0, 30.0)),
        "friction": round(rng.uniform(0.1, 0.6), 2), "kg": 0.3, "noise": 1.0, "off_mm": 3.0,
        "tilt_mrad": round(PLATE_MRAD + rng.uniform(0.0, 4.0), 1), "stiffness": 1.0,
        "chamfer_mm": 0.0, "yaw_deg": 10.0 if number % len(SHAPES) else 0.0,
    }  # fmt: skip


def _rejected(part: Part, shapes: bool) -> str:
    size_mm, depth_mm = part["size_mm"], part["depth_mm"]
    deepest, loosest = (3.0, 0.02) if shapes else (5.0, 0.05)
    if part["off_mm"] > size_mm:
        return "uncertainty above the diameter"
    if depth_mm > deepest * size_mm:
        return f"deeper than {deepest:g} D"
    if part["clearance_mm"] > loosest * size_mm:
        return f"clearance above {loosest:.0%} of D"
    if part["kg"] < KG_PER_MM3 * 0.25 * pi * size_mm**2 * (depth_mm + 20.0) and not shapes:
        return "tool lighter than a plastic peg"
    return "more than 1 kg on a Zebra Zero" if part["kg"] > 1.0 and part["arm"] == "zebra-zero" else ""


def job_of(part: Part) -> dict[str, Any]:
    """Return the job that a person would write for a part."""
    stated = next(each for each in (0.2, 0.4, 0.6) if part["friction"] <= each)
    soft, size_mm = part["stiffness"], part["size_mm"]
    return {
        "part": {
            "shape": part["shape"], "peg_mm": size_mm, "hole_mm": round(size_mm + 2.0 * part["clearance_mm"], 4),
            "depth_mm": part["depth_mm"], "chamfer_mm": min(part["chamfer_mm"], round(size_mm / 10.0, 2)),
            "friction_max": stated, "corner_radius_mm": round(0.1 * size_mm, 2), "flat_mm": round(0.1 * size_mm, 2),
            "depth_tolerance_mm": part.get("tolerance_mm", 0.2),
        },
        "tool": {
            "mass_kg": part["kg"] + 0.05, "rigid_mass_kg": 0.05, "axial_N_per_mm": 5.0 * soft,
            "lateral_N_per_mm": 40.0 * soft, "tilt_Nm_per_rad": 50.0 * soft, "torsion_Nm_per_rad": 50.0 * soft,
        },
        "arm": {"name": part["arm"]},
        "place": {
            "position_uncertainty_mm": part["off_mm"], "tilt_uncertainty_mrad": part["tilt_mrad"],
            "yaw_uncertainty_deg": part["yaw_deg"],
        },
        "cell": {
            "peg": {"friction": part["friction"]},
            "sensor": {"force_noise_N": 0.1 * part["noise"], "torque_noise_Nm": 0.004 * part["noise"]},
            **_tilts(part),
        },
    }  # fmt: skip


def _tilts(part: Part) -> dict[str, Any]:
    """Return the tilts. The grip is tilted; in six degrees of freedom, the plate is too, and the grip tilt varies."""
    if part["tilt_mrad"] < PLATE_MRAD:
        return {"conditions": {"grip_trials": 0}}
    return {"tilt_mrad": part["tilt_mrad"] - PLATE_MRAD, "conditions": {"plate_tilt_mrad": PLATE_MRAD}}


def planned(part: Part, shapes: bool) -> tuple[Part, Verdict]:
    """Return the part with the tolerance on its drawing, and the verdict on it."""
    usual = {**part, "tolerance_mm": 0.5 if shapes else 0.2}
    verdict = verdict_on(compose("job", job=job_of(usual)))
    least_mm = DEVIATIONS * verdict.regime.depth_m * 1e3
    if least_mm <= usual["tolerance_mm"]:
        return usual, verdict
    wider = {**part, "tolerance_mm": ceil(10.0 * least_mm) / 10.0}
    return wider, verdict_on(compose("job", job=job_of(wider)))


def settings(part: Part, task: str, learner: str) -> RunConfig:
    return overlay(compose("job", learner, job=job_of(part), task=task), {"seed": part["seed"]})


def trials_of(config: RunConfig, policy: str, trials: int, *, stop: bool = False) -> list[Mapping[str, Any]]:
    rows = list[Mapping[str, Any]]()
    for scored in run_series(config, policy, range(trials)):
        rows.append({
            "in": scored.success, "outcome": scored.outcome, "s": round(scored.exploration_time_s, 2),
            "N": 0.0 if scored.truth is None else round(scored.truth.peak_force_N, 1), "trip": scored.trip,
            "false": untrue(config, scored), "mm": 0.0 if scored.truth is None else scored.truth.depth_m * 1e3,
            "why": "" if scored.success else scored.report.events[-1].detail,
        })  # fmt: skip
        if stop and not scored.success:
            break
    return rows


def run(cell: Cell) -> dict[str, Any]:
    """Return the verdict on a part, or the results of its trials."""
    part, verdict = planned(cell["part"], cell["shapes"])
    began, chosen = time.process_time(), verdict.choice
    try:
        if cell["what"] == "plan":
            cell_config = settings(part, chosen.task, chosen.learner).cell
            row = {"valid": valid(cell_config), "reasons": list(verdict.reasons), "J": verdict.regime.jam_number}
            return row | {"task": chosen.task, "policy": chosen.policy or chosen.learner, "part": part}
        if cell["what"] == "best":
            counted = cell["trials"] + (not chosen.policy) - 1
            rows = trials_of(settings(part, chosen.task, chosen.learner), chosen.policy, counted)
            return {"trials": rows if chosen.policy else rows[1:], "cpu_s": round(time.process_time() - began, 1)}
        for task, policy in ORACLES[1:] if cell["shapes"] and part["shape"] != "round" else ORACLES:
            rows = trials_of(settings(part, task, "q-learning"), policy, cell["trials"] - 1, stop=True)
            if rows[-1]["in"]:
                break
        return {"oracle": rows[-1]["in"], "task": task, "trials": rows}
    except ConfigurationError as error:
        return {"refused": str(error), "trials": [], "oracle": False, "reasons": [str(error)]}


def figures(parts: Mapping[int, Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield the rows of the table."""
    inside = {number: part for number, part in parts.items() if part["plan"].get("valid", True)}
    tried = {number: part for number, part in inside.items() if part["best"]["trials"]}
    rows = [row for part in inside.values() for row in part["best"]["trials"]]
    easy = [number for number, part in inside.items() if part["oracle"]["oracle"]]
    for name, numbers in (("inserted", inside), ("inserted, parts that the oracle puts in each time", easy)):
        some = [row for number in numbers for row in inside[number]["best"]["trials"]]
        yield name, share(_in(some), len(some))
    rejected = [number for number in easy if inside[number]["plan"]["reasons"]]
    yield "parts that the oracle puts in and plan rejects", _of(rejected, len(easy))
    poor = [
        number for number, part in tried.items()
        if not part["plan"]["reasons"] and 2 * _in(part["best"]["trials"]) < len(part["best"]["trials"])
    ]  # fmt: skip
    yield "parts that plan accepts with less than half inserted", _of(poor, len(inside))
    yield "parts outside the simulator's valid range", _of([each for each in parts if each not in inside], len(parts))
    yield 'false "inserted"', share(sum(row["false"] for row in rows), len(rows))
    yield "trips", share(sum(bool(row["trip"]) for row in rows), len(rows))
    yield "highest true force, N", f"{max((row['N'] for row in rows), default=0.0):.1f}"


def _in(rows: list[Mapping[str, Any]]) -> int:
    return sum(row["in"] for row in rows)


def _of(numbers: list[int], count: int) -> str:
    return f"{len(numbers)} of {count}" + (f": {', '.join(map(str, numbers))}" if numbers else "")


def main() -> None:
    parser = parser_of(__doc__, seeds=1, first_seed=1, trials=10)
    parser.add_argument("--parts", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shapes", action="store_true", help="six degrees of freedom")
    parser.add_argument("--only", choices=("plan", "oracle", "best"), nargs="+", default=("plan", "best", "oracle"))
    parser.add_argument("--ids", type=int, nargs="*", help="these parts alone")
    options: argparse.Namespace = parser.parse_args()
    kept, rejected = drawn(options.seed, options.parts, options.shapes)
    print(f"drawn {sum(rejected.values()) + len(kept)}, rejected {dict(rejected)}")
    chosen = [part for part in kept if not options.ids or part["id"] in options.ids]
    cells = [
        {"what": what, "part": part, "shapes": options.shapes, "trials": 0 if what == "plan" else options.trials}
        for part in chosen
        for what in options.only
    ]
    parts: dict[int, dict[str, Any]] = {}
    for cell, found in sweep(options, run, cells):
        parts.setdefault(cell["part"]["id"], {})[cell["what"]] = found
    print(table(("id", "part", "plan", "in", "oracle", "ends", "highest N"), map(line, chosen, parts.values())))
    if len(options.only) == 3:
        print(table(("figure", "value"), figures(parts)))


def line(part: Part, found: Mapping[str, Any]) -> tuple[object, ...]:
    """Return the row of a part."""
    plan, rows = found.get("plan", {}), found.get("best", {}).get("trials", [])
    description = f"{plan.get('task', '')} {plan.get('policy', '')}{'' if plan.get('valid', True) else ' (not valid)'}"
    ends = dict(Counter(f"{row['outcome']}{' FALSE' * row['false']} {row['trip'][:40]}".strip() for row in rows))
    description += "".join(f"; {reason}" for reason in plan.get("reasons", []))
    names = (
        "arm",
        "size_mm",
        "clearance_mm",
        "depth_mm",
        "friction",
        "kg",
        "noise",
        "off_mm",
        "tilt_mrad",
        "stiffness",
    )
    oracle = found.get("oracle", {}).get("oracle", "")
    return (
        part["id"], " ".join(str(part[name]) for name in ("shape", *names)), description,
        f"{_in(rows)} of {len(rows)}", oracle, ends, max((row["N"] for row in rows), default=0.0),
    )  # fmt: skip


if __name__ == "__main__":
    main()
