"""One table of the force limits: in the code, in the document, and on the terminal of a run on a rig."""

from pathlib import Path

from palpate.core.supervision import SupervisionConfig, force_limits, limits_line
from palpate.core.trial.config import TaskConfig

DOCUMENT = Path(__file__).parents[4] / "docs" / "safety.md"


def test_the_documents_table_is_that_of_the_code() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    written = (
        text.partition("### Which force stops the arm first")[2]
        .partition("|---|---|---|---|\n")[2]
        .partition("\n\n")[0]
    )
    rows = force_limits(SupervisionConfig(), TaskConfig())
    assert written.splitlines() == [
        f"| {row.limit_N:g} N | `{row.setting}` | {row.watches} | {row.then} |" for row in rows
    ]


def test_the_order_is_that_of_the_limits_as_they_are_set() -> None:
    supervision = SupervisionConfig(max_force_N=20.0, on_trip="hold", weakened=("on_trip",))
    rows = force_limits(supervision, TaskConfig(max_force_N=25.0))
    assert [row.limit_N for row in rows] == [3.0, 20.0, 25.0, 25.0, 50.0]
    assert rows[1].setting == "supervision.max_force_N"
    assert rows[1].then.startswith("trip: hold, ")
    assert limits_line(supervision, TaskConfig(max_force_N=25.0)).startswith(
        "limits of the force: 3 N (supervision.unexpected_contact_N), 20 N (supervision.max_force_N), 25 N (task."
    )
