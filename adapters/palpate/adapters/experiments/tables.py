"""Render policies as tables."""

from palpate.adapters.log import aligned, counted
from palpate.core.policy import LEARNED, PolicyDocument, TableRow
from palpate.core.policy.belief import MIN_CONTACTS, RINGS_M, ContactModel


def render_table(document: PolicyDocument) -> str:
    """Return the state, source, best action, value and visits in aligned columns, in state order.

    No best action is shown for a learned state without visits, because all its values are equal. A belief is shown as
    its contact model, and a third-party policy as its code.
    """
    learner = document.learner
    learned = f"{learner.kind}, {_trained(learner.trials_learned)}" if learner else "nothing learned"
    if (third_party := document.third_party) is not None:
        package = f" ({third_party.distribution} {third_party.version})" if third_party.distribution else ""
        learned = f"made by {third_party.code}{package}, {_trained(third_party.trials_learned)}"
    head = f"{len(document.states)} states, {len(document.actions)} actions; {learned}"
    rows = [("state", "source", "best action", "value", "visits"), *map(_cells, document.table)]
    table = f"\n{aligned(rows, left=3)}" if len(rows) > 1 else ""
    contacts = f"\n{_contacts(learner.contact_model)}" if learner is not None and learner.kind == "belief" else ""
    return f"{head}\n{table}{contacts}"


def _trained(trials: int) -> str:
    return f"trained on {counted(trials, 'trial')}"


def _contacts(model: ContactModel | None) -> str:
    """Return the contact model ring by ring; torques are in N mm and scaled to a pressing force of 4.9 N."""
    if model is None:
        return f"no contact model yet: fewer than {MIN_CONTACTS} contacts in trials that ended in the hole\n"
    offset_x, offset_y = (1e3 * value for value in model.offset_Nm)
    head = (
        f"contact model of {model.contacts} contacts: offset {offset_x:.2f} {offset_y:.2f} N mm,"
        f" {1e3 * model.bias_Nm:.2f} N mm from trial to trial; torque behind by {model.lag:g} of a step\n\n"
    )
    rows: list[tuple[str, ...]] = [("mm from the hole", "torque along N mm", "across N mm", "noise N mm")]
    for ring_m, (along, across), noise in zip(RINGS_M, model.cue_Nm, model.noise_Nm, strict=True):
        rows.append((f"{1e3 * ring_m:.2f}", *(f"{1e3 * value:.2f}" for value in (along, across, noise))))
    return head + aligned(rows, left=0)


def _cells(row: TableRow) -> tuple[str, ...]:
    if row.value is None:
        return row.state, row.source, row.action, "-", "-"
    if row.visits == 0:
        action = "-" if row.source == LEARNED else row.action
        return row.state, row.source, action, "-", "never visited"
    return row.state, row.source, row.action, f"{row.value:.3f}", str(row.visits)
