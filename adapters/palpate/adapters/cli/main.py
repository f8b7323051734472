"""Entry point: picks the subcommand, turns errors into one line and an exit code."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from palpate.adapters.cli.commands import GROUPS, commands_of, help_of, loaded, options_of
from palpate.core.errors import ConfigurationError, LogError, OutputError, PalpateError, UsageError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0: done; 1: the run failed; 2: something in the call, a file or a folder is wrong; 130: ended by Ctrl-C.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(help_of())
        return 0
    if words[0] == "--version":
        words[0] = "version"
    try:
        return _run(words[0], words[1:])
    except (ConfigurationError, UsageError, OutputError, LogError) as error:
        return _fail(error, 2)
    except PalpateError as error:
        return _fail(error, 1)
    except KeyboardInterrupt:
        sys.stderr.write("\npalpate: stopped at once; finished trials are kept\n")
        return 130
    except BrokenPipeError:
        # The reader of our output went away (as `| head` does): nothing to say and nobody to say it to.
        sys.stderr.close()
        return 1


def _fail(error: PalpateError, code: int) -> int:
    sys.stderr.write(f"palpate: {' '.join(str(error).split())}\n")
    return code


def _run(name: str, words: Sequence[str]) -> int:
    group = name if name in GROUPS else ""
    if group:
        if not words or words[0] in ("-h", "--help"):
            sys.stdout.write(help_of(group))
            return 0
        name, words = words[0], words[1:]
    known = commands_of(group)
    if name not in known:
        raise UsageError(f"{name} is no command of {f'palpate {group}'.rstrip()}; there are {', '.join(known)}")
    command = known[name]
    options: object = words
    if command.options:
        # Each command is imported when it runs, after its words were found good: it may load the simulator.
        from palpate.adapters.cli.arguments import parse

        options = parse(options_of(command.options), f"{group} {name}".lstrip(), words)
    code = loaded(command.function)(options)
    return code if isinstance(code, int) else 0


if __name__ == "__main__":
    sys.exit(main())
