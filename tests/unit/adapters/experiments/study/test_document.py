from pathlib import Path

import pytest

from palpate.adapters.experiments.study import MOST_CELLS, Study, require_possible
from palpate.core.errors import ConfigurationError
from tests.unit.adapters.experiments.study.studies import study_of

EXAMPLES = Path(__file__).parents[5] / "examples" / "studies"
WHOLE = """
[study]
trials = 3
seeds = { first = 5, count = 2 }
policies = ["q-learning", "torque"]
[base]
arm = "ur5"
[base.learning.programmed]
"x+ y0" = "-x"
[grid]
"task.step_mm" = [1, 0.5]
task.area_centre = ["start", "goal"]
[[cells]]
[[cells]]
task.start_uncertainty_mm = 2
cell.peg.clearance_mm = 0.2
"""


def test_all_combinations_in_the_order_of_the_file(tmp_path: Path) -> None:
    study = study_of(WHOLE, tmp_path)
    cells = list(study.cells())
    assert len(cells) == study.count == 2 * 4 * 2 * 2
    assert study.combinations == 8
    assert len({cell.name for cell in cells}) == study.count
    assert [(c.policy, c.seed) for c in cells[:5]] == [
        ("q-learning", 5), ("q-learning", 6), ("torque", 5), ("torque", 6), ("q-learning", 5),
    ]  # fmt: skip
    assert cells[0].fields == {"task.step_mm": 1.0, "task.area_centre": "start"}
    assert cells[-1].fields == {
        "cell.peg.clearance_mm": 0.2,
        "task.start_uncertainty_mm": 2.0,
        "task.step_mm": 0.5,
        "task.area_centre": "goal",
    }


def test_a_cells_configuration(tmp_path: Path) -> None:
    study = study_of(WHOLE, tmp_path)
    *_, last = study.cells()
    config = study.config(last.fields, last.seed)
    assert (config.arm, config.seed, config.task.step_mm, config.cell.peg.clearance_mm) == ("ur5", 6, 0.5, 0.2)
    assert config.learning.programmed == {"x+ y0": "-x"}


def test_little_must_be_said(tmp_path: Path) -> None:
    study = study_of("[study]", tmp_path)
    assert (study.trials, study.seeds, study.policies, study.count) == (350, range(1), ("q-learning",), 1)
    assert next(study.cells()).fields == {}


@pytest.mark.parametrize("text", [WHOLE, "[study]", "[study]\nseeds = [9, 2]", "[[cells]]\n[[cells]]\narm = 'ur5'"])
def test_what_is_written_down_reads_back_as_the_same_study(tmp_path: Path, text: str) -> None:
    study = study_of(text, tmp_path)
    written = study.text({"numpy": "1.2.3"}, {"a file.json": "00ff"})
    assert study_of(written, tmp_path) == study
    # One form, however it was written.
    assert study_of(written, tmp_path).text({"numpy": "1.2.3"}, {"a file.json": "00ff"}) == written


def test_cells_keep_their_names_when_the_study_grows(tmp_path: Path) -> None:
    before = {cell.name for cell in study_of(WHOLE, tmp_path).cells()}
    grown = WHOLE.replace("count = 2", "count = 3").replace("[1, 0.5]", "[0.25, 1.0, 0.5]")
    grown = grown.replace('["q-learning", "torque"]', '["random", "torque", "q-learning"]')
    assert before < {cell.name for cell in study_of(grown, tmp_path).cells()}


def test_files_that_results_depend_on(tmp_path: Path) -> None:
    policy = tmp_path / "policy.json"
    policy.touch()
    study = study_of(
        f'[study]\npolicies = ["torque", "{policy}"]\n[base]\nlearning.examples = "e.csv"\n'
        '[grid]\n"perception.memory" = ["none", "last-2", "m.json"]',
        tmp_path,
    )
    assert study.files() == {str(policy), "e.csv", "m.json"}


def test_a_study_without_end_is_counted_without_being_listed(tmp_path: Path) -> None:
    text = f"[study]\nseeds = {{ count = {MOST_CELLS} }}\n[grid]\n"
    text += "".join(f'"{name}" = {list(range(1, 40))}\n' for name in ("task.tare_ticks", "perception.fit_trials"))
    assert study_of(text, tmp_path).count == MOST_CELLS * 39**2


@pytest.mark.parametrize(
    ("text", "field", "accepted"),
    [
        ("[grid]\n'task.stepp_mm' = [1]", "task.stepp_mm", "did you mean task.step_mm?"),
        ("[grid]\n'task.step_mm.x' = [1]", "task.step_mm.x", "no such field"),
        ("[grid]\ntask = [1]", "task", "one of its fields"),
        ("[grid]\n'task.step_mm' = []", "grid.task.step_mm", "at least one value"),
        ("[grid]\n'task.step_mm' = 0.5", "grid.task.step_mm", "as in [0.5]"),
        ("[grid]\n'task.step_mm' = [1, 1.0]", "grid.task.step_mm", "once"),
        ("[grid]\n'task.step_mm' = [1, true]", "task.step_mm", "a number from 0.01 to 5"),
        ("[grid]\nseed = [1]", "grid.seed", "[study]"),
        ("[base]\nscenari = 'paper'", "scenari", "did you mean scenario?"),
        ("cells = []", "cells", "at least one"),
        ("cells = 3", "cells", "[[cells]]"),
        ("[[cells]]\narm = 'ur5'\n[[cells]]\narm = 'ur5'", "cells", "once"),
        ("[grid]\narm = ['ur5']\n[[cells]]\narm = 'ur5'", "cells.arm", "[grid]"),
        ("[study]\ntrails = 3", "study.trails", "did you mean study.trials?"),
        ("[stady]", "stady", "did you mean study?"),
        ("study = 3", "study", "a table"),
        ("[study]\ntrials = 0", "study.trials", "from 1"),
        ("[study]\ntrials = '9'", "study.trials", "a whole number"),
        ("[study]\nseeds = []", "study.seeds", "a list of seeds"),
        ("[study]\nseeds = 3", "study.seeds", "a list of seeds"),
        ("[study]\nseeds = [1, 1]", "study.seeds", "once"),
        ("[study]\nseeds = [-1]", "study.seeds", "from 0"),
        ("[study]\nseeds = { first = 3 }", "study.seeds.count", "from 1"),
        ("[study]\nseeds = { cuont = 3 }", "study.seeds.cuont", "did you mean study.seeds.count?"),
        ("[study]\nseeds = { first = 9223372036854775807, count = 2 }", "study.seeds.first", "from 0"),
        ("[study]\npolicies = []", "study.policies", "q-learning"),
        ("[study]\npolicies = 'torque'", "study.policies", "a list"),
        ("[study]\npolicies = ['torqe']", "study.policies", "torque"),
        ("[study]\npolicies = ['torque', 'torque']", "study.policies", "once"),
        ("format = 2", "format", "1"),
        ("[study", "study file", "TOML"),
        ("", "study file", "not empty"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path: Path, text: str, field: str, accepted: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        study_of(text, tmp_path)
    assert caught.value.field == field
    assert accepted in caught.value.accepted


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_the_examples_can_be_run(path: Path) -> None:
    study = Study.read(path)
    require_possible(study)
    assert study.count > 10
