"""What a notebook says, for tests."""

from palpate.adapters.hardware.doctor.findings import Level, Notebook


def told(notes: Notebook, level: Level) -> list[str]:
    """The findings of a level, each with its remedy."""
    return [f"{f.text} -> {f.remedy}" for f in notes.section().findings if f.level is level]


def facts(notes: Notebook) -> dict[str, str]:
    """The facts by name."""
    return {fact.name: fact.text for fact in notes.section().facts}


def rows(notes: Notebook) -> list[tuple[str, ...]]:
    """The rows of the last table."""
    return list(notes.section().tables[-1].rows)
