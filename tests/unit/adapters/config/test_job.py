"""A job file: numbers in other units, relations between values, and the page that lists its fields.

``PALPATE_SNAPSHOT=write`` writes the fields on the page again.
"""

import os
import runpy
import tomllib
from copy import deepcopy
from math import inf, nan
from pathlib import Path

import pytest

from palpate.adapters.config import compose, read_job, texts_of
from palpate.adapters.experiments import ready_pose, require_usable
from palpate.core.errors import ConfigurationError
from palpate.core.job import JOB_TABLES, STATED, Job
from palpate.core.ports import accepted_by, kinds_of

JOBS = {path.stem: tomllib.loads(path.read_text()) for path in Path("examples/jobs").resolve().glob("*.toml")}
TASKS = {"square-20": "insertion-6dof", "connector-16": "insertion-6dof"}


def whole(name):
    """A job with every field of its four tables, also those that its file leaves as they are."""
    job = deepcopy(JOBS[name])
    for table in JOB_TABLES:
        held = getattr(Job(), table)
        job[table] = {key: getattr(held, key) for key in kinds_of(type(held))} | job.get(table, {})
        job[table] = {key: list(value) if isinstance(value, tuple) else value for key, value in job[table].items()}
    return job


def usable(name, job):
    """All that a run looks at before anything moves."""
    config = compose("job", task=TASKS.get(name, "insertion"), job=read_job(job))
    require_usable(config, ready_pose(config))


def numbers(job):
    """Table, field, place in a list, and value of each number of the four tables."""
    for table in JOB_TABLES:
        for field, value in job[table].items():
            items = enumerate(value) if isinstance(value, list) else [(None, value)]
            yield from ((table, field, place, each) for place, each in items if isinstance(each, float))


@pytest.mark.parametrize("table", JOB_TABLES)
def test_number_that_is_none_or_in_another_unit_is_refused_by_its_name(table):
    for name in ("paper-peg", "square-20"):
        for _, field, place, value in [number for number in numbers(whole(name)) if number[0] == table]:
            # Micrometres for millimetres, newtons per metre for newtons per millimetre, grams for kilograms.
            for wrong in (nan, -inf, 1e9, *([1e3 * value] if value else [])):
                job = whole(name)
                if place is None:
                    job[table][field] = wrong
                else:
                    job[table][field][place] = wrong
                with pytest.raises(ConfigurationError) as caught:
                    usable(name, job)
                message = str(caught.value)
                # Place, stiffness and size enter the depth's standard deviation; its message says which to change.
                summed = message.startswith(("part.depth_tolerance_mm ", "place "))
                assert f"{table}.{field}" in message or summed, message
                assert "\n" not in message


@pytest.mark.parametrize("name", JOBS)
def test_the_example_jobs_can_be_used_as_they_are_and_state_the_simulator_s_friction(name):
    usable(name, JOBS[name])
    usable(name, whole(name))


@pytest.mark.parametrize(
    ("table", "fields", "message"),
    [
        ("part", {"hole_mm": 29.0}, "part.hole_mm must be from 29.002 to 39 for part.peg_mm = 29"),
        ("part", {"hole_depth_mm": 9.0}, "part.hole_depth_mm must be at least part.depth_mm = 10"),
        ("part", {"depth_tolerance_mm": 0.02}, "part.depth_tolerance_mm must be at least 0.0"),
        ("part", {"depth_mm": 0.7}, "part.depth_mm must be more than 0.7 = place.height_uncertainty_mm"),
        ("part", {"chamfer_mm": 7.5}, "part.chamfer_mm must be below 7.25"),
        ("tool", {"tip_mm": [0.0, 0.0, -140.0]}, "the tip is beyond the sensor"),
        ("tool", {"tip_rpy_deg": [180.0, 0.0, 0.0]}, "a peg that points away from the sensor"),
        ("tool", {"rigid_mass_kg": 0.35}, "at least 0.01 below tool.mass_kg = 0.35"),
        ("tool", {"centre_of_mass_mm": [0.0, 0.0, 150.0]}, "a place on the tool"),
        ("place", {"x_mm": 1900.0}, "place must be a place that zebra-zero reaches"),
        ("place", {"position_uncertainty_mm": 0.003}, "0, or a number from 0.02 to 20"),
        ("place", {"tilt_uncertainty_mrad": 4000.0}, "0, or a number from 0.05 to 100"),
        ("limits", {"force_N": 1.5}, "at least 1.86 with a force sensor of 0.1 N noise"),
        ("cell", {"hole_uncertainty": 1.0}, "did you mean cell.hole_uncertainty_mm?"),
        ("arm", {"lower": [0.0]}, "arm.lower = [0.0]: no such field; did you mean arm.lower_rad?"),
        ("arm", {"lower_rad": [0.0]}, "6 numbers, one per joint"),
    ],
)
def test_relations_are_refused_with_the_bound_and_what_to_do(table, fields, message):
    job = deepcopy(JOBS["paper-peg"])
    job[table] = {**job.get(table, {}), **fields}
    with pytest.raises(ConfigurationError) as caught:
        usable("paper-peg", job)
    assert message in str(caught.value)


PAGE = Path(__file__).parents[4] / "docs" / "job-file.md"
BEGIN, END = "<!-- fields -->\n", "<!-- end of fields -->\n"


def fields():
    lines = []
    for name in JOB_TABLES:
        table = getattr(Job(), name)
        lines += [f"| `[{name}]` | accepted | default | |", "|---|---|---|---|"]
        for field, kind in kinds_of(type(table)).items():
            stated = field in STATED.get(name, ())
            value = getattr(table, field)
            shown = "" if stated else f"`{list(value) if isinstance(value, tuple) else value}`"
            accepted = accepted_by(kind).removeprefix("a number ")
            key = f"**`{field}`**" if stated else f"`{field}`"
            lines.append(f"| {key} | {accepted} | {shown} | {texts_of(type(table))[field]} |")
        lines.append("")
    return "\n".join(lines[:-1]) + "\n"


def test_the_page_lists_every_field_as_it_is_declared():
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    listed, _, after = rest.partition(END)
    if os.environ.get("PALPATE_SNAPSHOT") == "write":
        listed = fields()
        PAGE.write_text(f"{before}{BEGIN}{listed}{END}{after}", encoding="utf-8")
    assert listed == fields()


def test_the_example_on_the_page_runs(tmp_path, monkeypatch):
    text = PAGE.read_text(encoding="utf-8")
    script = tmp_path / "example.py"
    script.write_text(text.partition("```python\n")[2].partition("```")[0], encoding="utf-8")
    monkeypatch.chdir(PAGE.parents[1])
    runpy.run_path(str(script))
