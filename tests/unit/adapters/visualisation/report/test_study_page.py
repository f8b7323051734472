from pathlib import Path

from palpate.adapters.visualisation.report.study_page import study_page
from tests.unit.adapters.visualisation.report.test_study_source import STEP, cell


def test_a_study_without_tables_of_values_speaks_of_no_policies(tmp_path: Path) -> None:
    cell(tmp_path, "a", {STEP: 0.5}, "torque")
    sections = study_page(tmp_path, "study", logs=False).sections
    (policies,) = (section for section in sections if section.title == "Policies")
    assert not policies.text
