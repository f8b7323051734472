"""A job file: every value is tried out of range, in another type and in another unit, by walking the document."""

import tomllib
from collections.abc import Iterator, Mapping
from copy import deepcopy
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.config import compose, read_job
from palpate.adapters.experiments import ready_pose, require_usable
from palpate.core.errors import ConfigurationError
from palpate.core.job import JOB_TABLES, STATED, Job
from palpate.core.ports import kinds_of

JOBS = {path.stem: tomllib.loads(path.read_text()) for path in Path("examples/jobs").resolve().glob("*.toml")}
TASKS = {"square-20": "insertion-6dof", "connector-16": "insertion-6dof"}
PLACES = {"place", "arm"}
"""What is refused about them may name the pose or the arm as a whole."""
Path_ = tuple[str | int, ...]


def whole(name: str) -> dict[str, Any]:
    """A job with every field of its four tables, also those that its file leaves as they are."""
    job = deepcopy(JOBS[name])
    for table in JOB_TABLES:
        held = getattr(Job(), table)
        job[table] = {key: getattr(held, key) for key in kinds_of(type(held))} | job.get(table, {})
        job[table] = {key: list(value) if isinstance(value, tuple) else value for key, value in job[table].items()}
    return job


def walk(held: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    inner = held.items() if isinstance(held, dict) else enumerate(held) if isinstance(held, list) else ()
    for key, value in inner:
        yield (*path, key), value
        yield from walk(value, (*path, key))


def changed(name: str, path: Path_, value: Any) -> dict[str, Any]:
    job = whole(name)
    place: Any = job
    for key in path[:-1]:
        place = place[key]
    if value is DELETED:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return job


DELETED = object()
SUM = "part.depth_tolerance_mm = "
"""Tilt, stiffness, size and arm all enter the depth's standard deviation; its message says which of them to change."""


def usable(name: str, job: Mapping[str, Any]) -> None:
    """All that a run looks at before anything moves."""
    config = compose("job", task=TASKS.get(name, "insertion"), job=read_job(job))
    require_usable(config, ready_pose(config))


def refusal(name: str, path: Path_, value: Any) -> str:
    """What is said of a job with a changed value, in one line that names it; empty where it can be used."""
    try:
        usable(name, changed(name, path, value))
    except ConfigurationError as error:
        told = str(error)
        assert "\n" not in told
        assert "is refused: " in told
        stated = error.field.split(".")[0].split("[")[0] in (*JOB_TABLES, "arm", "cell")
        assert stated or "a nearer place" in told, told
        dotted = ".".join(key for key in path if isinstance(key, str))
        names = {dotted, "place" if path[0] == "arm" else "", str(path[0]) if path[0] in PLACES else ""} - {""}
        assert any(name in told for name in names) or told.startswith(SUM), told
        return told
    return ""


WALKED = [(name, path) for name in ("paper-peg", "square-20") for path, _ in walk(whole(name))]
"""One job of each task."""


@pytest.mark.parametrize(("name", "path"), WALKED, ids=lambda one: one if isinstance(one, str) else str(one))
def test_every_value_of_a_job_is_checked(name: str, path: Path_) -> None:
    value = dict(walk(whole(name)))[path]
    if isinstance(path[-1], str):
        refusal(name, path, DELETED)
    for wrong in (3.0, True, "text", [], {}, [value]):
        kind = float if isinstance(value, (int, float)) else type(value)
        if type(wrong) is not kind:
            expected = path == ("arm",) and wrong == "text"
            assert refusal(name, path, wrong) or expected, wrong
    if isinstance(value, list):
        assert refusal(name, path, value[:-1])
        assert refusal(name, path, [*value, 0.0])
    if isinstance(value, dict):
        assert "no such field" in refusal(name, path, {**value, "lenght_mm": 1.0})
    if isinstance(value, float):
        for wrong in (nan, inf, -inf, 1e9, -1e9):
            assert refusal(name, path, wrong), wrong
        for factor in (2.0, 0.5, 10.0, 0.1, 0.0, -1.0, 1e-3):
            refusal(name, path, factor * value)
        # Micrometres for millimetres, newtons per metre for newtons per millimetre, grams for kilograms.
        assert value == 0.0 or refusal(name, path, 1e3 * value)


@pytest.mark.parametrize("name", JOBS)
def test_the_example_jobs_can_be_used_as_they_are_and_state_the_simulator_s_friction(name: str) -> None:
    usable(name, JOBS[name])
    usable(name, whole(name))


@pytest.mark.parametrize(
    ("table", "fields", "told"),
    [
        ("part", {"hole_mm": 29.0}, "part.hole_mm = 29.0 is refused: from 29.002 to 39 for part.peg_mm = 29"),
        ("part", {"hole_depth_mm": 9.0}, "part.hole_depth_mm = 9.0 is refused: at least part.depth_mm = 10"),
        ("part", {"depth_tolerance_mm": 0.02}, "part.depth_tolerance_mm = 0.02 is refused: at least 0.0"),
        ("part", {"depth_mm": 0.7}, "part.depth_mm = 0.7 is refused: more than 0.7 = place.height_uncertainty_mm"),
        ("part", {"chamfer_mm": 7.5}, "part.chamfer_mm = 7.5 is refused: below 7.25"),
        ("tool", {"tip_mm": [0.0, 0.0, -140.0]}, "the tip is beyond the sensor"),
        ("tool", {"tip_rpy_deg": [180.0, 0.0, 0.0]}, "a peg that points away from the sensor"),
        ("tool", {"rigid_mass_kg": 0.35}, "at least 0.01 below tool.mass_kg = 0.35"),
        ("tool", {"centre_of_mass_mm": [0.0, 0.0, 150.0]}, "a place on the tool"),
        ("place", {"x_mm": 1900.0}, "place = '(1900, 0, 23) mm' is refused: a place that zebra-zero reaches"),
        ("place", {"position_uncertainty_mm": 0.003}, "0, or a number from 0.02 to 20"),
        ("place", {"tilt_uncertainty_mrad": 4000.0}, "0, or a number from 0.05 to 100"),
        ("limits", {"force_N": 1.5}, "at least 1.86 with a force sensor of 0.1 N noise"),
        ("cell", {"hole_uncertainty": 1.0}, "did you mean cell.hole_uncertainty_mm?"),
        ("arm", {"lower": [0.0]}, "arm.lower = [0.0] is refused: no such field; did you mean arm.lower_rad?"),
        ("arm", {"lower_rad": [0.0]}, "6 numbers, one a joint"),
    ],
)
def test_relations_are_refused_with_the_bound_and_what_to_do(table: str, fields: dict[str, Any], told: str) -> None:
    job = deepcopy(JOBS["paper-peg"])
    job[table] = {**job.get(table, {}), **fields}
    with pytest.raises(ConfigurationError) as caught:
        usable("paper-peg", job)
    assert told in str(caught.value)


@pytest.mark.parametrize("table", STATED)
def test_what_no_default_is_safe_for_must_be_stated(table: str) -> None:
    job = deepcopy(JOBS["paper-peg"])
    del job[table]
    with pytest.raises(ConfigurationError, match=", ".join(f"{table}.{field}" for field in STATED[table])):
        read_job(job)


def test_another_table_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ConfigurationError, match="did you mean part"):
        read_job({**JOBS["paper-peg"], "parts": {}})
    with pytest.raises(ConfigurationError, match="other settings belong in --config"):
        read_job({**JOBS["paper-peg"], "task": {"step_mm": 0.5}})
