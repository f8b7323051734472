from dataclasses import replace

from palpate.adapters.visualisation.report.run_page import drawn_values
from tests.unit.adapters.samples import trial_rows


def test_what_was_drawn_is_told_with_what_it_was_where_trials_failed() -> None:
    rows = [
        replace(row, drawn={"hole_yaw_deg": -4.0 + row.trial}, success=row.trial != 2)
        for row in trial_rows(1.0, 2.0, 3.0)
    ]
    (table,) = drawn_values(rows)
    assert table.rows == (("hole_yaw_deg", "-4", "-2", "-2 (trial 2)"),)
    assert drawn_values(trial_rows(1.0)) == []
