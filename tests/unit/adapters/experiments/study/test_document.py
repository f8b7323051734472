from pathlib import Path

import pytest

from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments.study import Study, setting_of
from palpate.core.errors import ConfigurationError

EXAMPLES = Path(__file__).parents[5] / "examples" / "studies"
WHOLE = """
[study]
trials = 3
seeds = [5, 6]
policies = ["q-learning", "torque"]
[base]
arm = "ur5"
[base.learning.programmed]
"x+ y0" = "-x"
[[grid]]
"task.step_mm" = [1, 0.5]
task.area_centre = ["start", "goal"]
[[grid]]
task.start_uncertainty_mm = [2]
"cell.peg.clearance_mm" = [0.2]
"""


def study_of(text, folder):
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return Study.read(path)


def test_all_combinations_in_the_order_of_the_file(tmp_path):
    study = study_of(WHOLE, tmp_path)
    conditions = list(study.conditions())
    assert len(conditions) == study.count == (4 + 1) * 2 * 2
    assert [each.name for each in conditions[:5]] == [
        "q-learning,step_mm=1.0,area_centre=start,seed=5",
        "q-learning,step_mm=1.0,area_centre=start,seed=6",
        "torque,step_mm=1.0,area_centre=start,seed=5",
        "torque,step_mm=1.0,area_centre=start,seed=6",
        "q-learning,step_mm=1.0,area_centre=goal,seed=5",
    ]
    last = conditions[-1]
    assert last.fields == {"task.start_uncertainty_mm": 2.0, "cell.peg.clearance_mm": 0.2}
    config = last.config
    assert (config.arm, config.seed, config.task.step_mm, config.cell.peg.clearance_mm) == ("ur5", 6, 0.7, 0.2)
    assert config.learning.programmed == {"x+ y0": "-x"}


@pytest.mark.parametrize(
    "text",
    [
        '"task.step_mm" = 0.5\n"cell.peg.clearance_mm" = 0.2',
        "task.step_mm = 0.5\ncell.peg.clearance_mm = 0.2",
        '[base.task]\nstep_mm = 0.5\n[base.cell]\n"peg.clearance_mm" = 0.2',
    ],
)
def test_setting_may_be_written_in_every_way_of_toml_and_goes_over_the_scenario(tmp_path, text):
    text = f"[base]\nscenario = 'blind'\nperception.memory = 'a.json'\n{text}"
    config = next(study_of(text, tmp_path).conditions()).config
    expected = overlay(scenario("blind"), {"cell": {"peg": {"clearance_mm": 0.2}}})
    assert (config.cell, config.task.step_mm, config.recording.enabled) == (expected.cell, 0.5, False)
    # Workers have other working folders.
    assert config.perception.memory == str(Path.cwd() / "a.json")
    assert setting_of(config, "perception.channels") == ["x", "y", "tx", "ty"]


def test_names_hold_tables_where_last_words_are_alike(tmp_path):
    text = '[study]\npolicies = ["torque"]\n[grid]\n"task.goal.x_mm" = [400]\n"place.x_mm" = [400]'
    assert next(study_of(text, tmp_path).conditions()).name == "torque,task.goal.x_mm=400.0,place.x_mm=400.0,seed=0"


@pytest.mark.parametrize(
    ("text", "field", "accepted"),
    [
        ("[grid]\n'task.stepp_mm' = [1]", "task.stepp_mm", "did you mean task.step_mm?"),
        ("[grid]\n'task.step_mm' = [1, 1.0]", "study", "once"),
        ("[grid]\nseed = [1]", "seed", "[study]"),
        ("[study]\nseeds = 10000\npolicies = ['torque', 'random']", "study", "at most 10000"),
        (f"[grid]\n'learning.examples' = ['{'a' * 200}.csv']", "study", "at most 200 characters"),
        ("", "study file", "not empty"),
    ],
)
def test_unusable_study_is_named(tmp_path, text, field, accepted):
    with pytest.raises(ConfigurationError) as caught:
        list(study_of(text, tmp_path).conditions())
    assert caught.value.field == field
    assert accepted in caught.value.accepted


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_examples_can_be_run(path):
    study = Study.read(path)
    conditions = list(study.conditions())
    assert len(conditions) > 10
    for condition in conditions[:: len(study.seeds)]:
        condition.require_possible()
