"""``palpate completion``: words that a shell completes."""

import sys
from collections.abc import Sequence
from typing import Final

from palpate.adapters.cli.arguments import flags_of
from palpate.adapters.cli.commands import COMMANDS, GROUPS, commands_of, options_of
from palpate.core.errors import UsageError

_SCRIPT: Final = """\
# What bash and zsh complete after palpate. In ~/.bashrc or ~/.zshrc: eval "$(palpate completion)"
if [ -n "${ZSH_VERSION:-}" ]; then autoload -Uz compinit bashcompinit && compinit && bashcompinit; fi
_palpate() {
    local words= current="${COMP_WORDS[COMP_CWORD]}"
    case "$COMP_CWORD:${COMP_WORDS[*]:1:2} " in
@CASES@
    esac
    # Flags once a dash is there; what no word fits is a file.
    if [[ $words == --* && $current != -* ]]; then words=; fi
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _palpate palpate
"""


def completion(words: Sequence[str]) -> None:
    """Print the script; it names every command and flag, so that completing starts no Python."""
    if words:
        raise UsageError(f"palpate completion takes no {words[0]}: one script is for bash and zsh")
    places = {"1:*": list(commands_of())} | {f"2:{group} *": list(commands_of(group)) for group in GROUPS}
    for name, command in COMMANDS.items():
        if command.options:
            places[f"*:{name} *"] = [*flags_of(options_of(command.options)), "--help"]
    cases = ""
    for place, known in places.items():
        pattern = place.replace(" ", "\\ ")
        cases += f'    {pattern}) words="{" ".join(known)}" ;;\n'
    sys.stdout.write(_SCRIPT.replace("@CASES@\n", cases))
