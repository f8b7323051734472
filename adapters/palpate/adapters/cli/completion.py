"""``palpate --tyro-print-completion SHELL``: tyro's own shell completion, over all commands."""

from collections.abc import Sequence
from dataclasses import make_dataclass
from typing import Annotated, Any, Final, Union

import tyro

from palpate.adapters.cli.commands import GROUPS, commands_of, options_of
from palpate.core.errors import UsageError

FLAG: Final = "--tyro-print-completion"
_SHELLS: Final = ("bash", "zsh", "tcsh", "fish")


def print_completion(words: Sequence[str]) -> None:
    """Print the script for a shell, which names every command and flag."""
    if len(words) != 1 or words[0] not in _SHELLS:
        raise UsageError(f"{FLAG} takes one shell: {', '.join(_SHELLS)}")
    tyro.cli(
        _commands(""),
        prog="palpate",
        args=[FLAG, *words],
        config=(tyro.conf.HelptextFromCommentsOff, tyro.conf.OmitSubcommandPrefixes),
    )


def _commands(group: str) -> Any:
    """Return the union of the options of all commands, or of those of a group."""
    kinds: list[Any] = []
    for name, command in commands_of(group).items():
        if name in GROUPS and not group:
            kind: Any = make_dataclass(name, [("command", _commands(name))])
        else:
            kind = options_of(command.options)
        kinds.append(Annotated[kind, tyro.conf.subcommand(name)])
    return Union[tuple(kinds)]  # noqa: UP007
