"""The automaton that was inferred, or that gives a policy its states."""

from typing import Final

from palpate.adapters.visualisation.automaton import machine_picture
from palpate.adapters.visualisation.report.page import PageSection, PageTable, Picture, counted
from palpate.core.automata import AutomatonState, Kind, Machine, shown_name
from palpate.core.errors import ConfigurationError
from palpate.core.perception import stage_from_dict
from palpate.core.policy import PolicyDocument

_MOST_DRAWN: Final = 40
"""States of an automaton that can still be read in a picture."""


def machine_in(document: PolicyDocument) -> Machine | None:
    """The automaton that gives a policy its states; None where states come from elsewhere."""
    data = document.perception.get("identifier")
    if not isinstance(data, dict) or data.get("kind") != "automaton":
        return None
    state = stage_from_dict(data, "perception.identifier")
    if not isinstance(state, AutomatonState):
        raise ConfigurationError("perception.identifier.kind", data["kind"], "an automaton")
    return Machine(
        kind=Kind.DFA,
        alphabet=state.symbols,
        transitions=state.transitions,
        # Its outputs have no importance here: its state is the input of the policy.
        state_outputs=(False,) * len(state.automaton),
        start=state.start,
        labels=state.automaton,
    )


def automaton_section(
    machine: Machine, name: str = "automaton", title: str = "Automaton", text: str = ""
) -> PageSection:
    """The automaton as a picture, where it is small enough, and as a table, below a text on what it is for."""
    states, names = len(machine.transitions), machine.names
    pictures: tuple[Picture, ...] = ()
    if states <= _MOST_DRAWN:
        alt = (
            f"{title} with {counted(states, 'state')} over {counted(len(machine.alphabet), 'symbol')}, as in the table."
        )
        caption = "The arrow from nowhere leads to the start. An edge has the colour of the state that it leaves."
        pictures = (Picture(name, alt, caption, machine_picture(machine, file_format="png"), wide=True),)
    head = ("state", *map(shown_name, machine.alphabet))
    rows = tuple(
        (names[n], *("-" if target is None else names[target] for target in row))
        for n, row in enumerate(machine.transitions)
    )
    caption = f"Next state by symbol; it starts in {names[machine.start]}"
    return PageSection(title, (text,) if text else (), tables=(PageTable(caption, head, rows),), pictures=pictures)
