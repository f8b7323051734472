"""Entry point that selects the subcommand and reports each error in one line and with an exit code."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from time import monotonic
from typing import Final

from palpate.adapters.cli.commands import GROUPS, commands_of, function_of, help_of, options_of
from palpate.adapters.mujoco import GL_VARIABLE
from palpate.adapters.signals import on_ending_signal
from palpate.core import errors

QUIET_S: Final = 5.0
"""Time allowed for a command to close logs and devices, during which further signals are ignored."""


class Interrupts:
    """Context in which signals that end a process raise KeyboardInterrupt; ``raised`` is True after such a signal.

    SIGINT and SIGTERM raise it even if the parent shell ignores them. Another signal within ``QUIET_S`` is ignored,
    because it would interrupt the closing of logs and devices. Later signals raise it again. With ``last``, SIGINT is
    ignored after the context exits, because the process ends with the command.
    """

    def __init__(self, *, last: bool = False) -> None:
        self.raised = False
        self._last, self._raised_s = last, 0.0
        self._handled = ExitStack()

    def __enter__(self) -> Interrupts:
        if self._last and threading.current_thread() is threading.main_thread():
            self._handled.callback(signal.signal, signal.SIGINT, signal.SIG_IGN)
        self._handled.enter_context(on_ending_signal(self._raise))
        return self

    def __exit__(self, *_: object) -> None:
        self._handled.close()

    def _raise(self, number: int) -> None:
        now_s = monotonic()
        if self.raised and now_s - self._raised_s < QUIET_S:
            return
        self.raised, self._raised_s = True, now_s
        raise KeyboardInterrupt


_LEFT_OUT: Final = ("torch", "pytest")
"""Packages that a slim installation lacks; they are imported only where needed."""
_DEBUG: Final = "--debug"
"""Option for all commands that prints an error's traceback."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0: done; 1: the run failed; 2: an argument, a file or a folder is invalid; 130: ended by Ctrl-C or
            another signal.
    """
    _open_streams()
    if arguments is None:
        # Importing Matplotlib or MuJoCo fails if these variables name a missing backend, even if nothing is drawn.
        os.environ.pop("MPLBACKEND", None)
        os.environ[GL_VARIABLE] = os.environ.pop("MUJOCO_GL", "")
    given = sys.argv[1:] if arguments is None else arguments
    words = [word for word in given if word != _DEBUG]
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(help_of())
        return 0
    with Interrupts(last=arguments is None) as interrupts:
        return _ended(words, interrupts, debug=_DEBUG in given)


def _ended(words: Sequence[str], interrupts: Interrupts, *, debug: bool) -> int:
    try:
        code = _run(words[0], words[1:])
        sys.stdout.flush()
        return code
    except (errors.ConfigurationError, errors.UsageError, errors.OutputError, errors.LogError) as error:
        return _fail(error, 2, debug=debug)
    except errors.PalpateError as error:
        return _fail(error, 1, debug=debug)
    except ModuleNotFoundError as error:
        if error.name not in _LEFT_OUT:
            return _unexpected(error, debug=debug)
        text = f"this needs {error.name}, which is missing in a slim installation: pip install {error.name}"
        return _fail(errors.UsageError(text), 2, debug=debug)
    except KeyboardInterrupt:
        return _stopped()
    except BrokenPipeError:
        # The reader of the output has exited, as with `| head`, so there is nothing to report.
        sys.stderr.close()
        return 1
    except OSError as error:
        if error.filename:
            return _fail(errors.PalpateError(f"{error.filename}: {error.strerror}"), 2, debug=debug)
        # For example, the output is redirected to a full disk.
        sys.stdout = open(os.devnull, "w")
        return _fail(errors.PalpateError(f"{error.strerror or error}; earlier results are kept"), 1, debug=debug)
    except Exception as error:
        if not interrupts.raised:
            return _unexpected(error, debug=debug)
        # Extension modules and callbacks may turn an interrupt into a different error.
        return _stopped()


def _stopped() -> int:
    with suppress(OSError):
        sys.stderr.write("\npalpate: stopped; finished results are kept\n")
    return 130


def _unexpected(error: Exception, *, debug: bool) -> int:
    """Print the location of an error in third-party code; an error in palpate's code keeps its traceback."""
    if not errors.raised_at(error):
        raise error
    return _fail(errors.PalpateError(f"{errors.describe(error)}; {_DEBUG} prints the traceback"), 1, debug=debug)


def _fail(error: errors.PalpateError, code: int, *, debug: bool) -> int:
    with suppress(OSError):
        if debug:
            import traceback

            traceback.print_exc()
        sys.stderr.write(f"palpate: {errors.one_line(error)}\n")
    return code


def _open_streams() -> None:
    """Make printing safe for closed streams and for characters that the terminal cannot display."""
    if sys.stdin is None:
        # Standard input is closed too, so a prompt gets no answer.
        sys.stdin = open(os.devnull)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            # The shell closed the stream, so the next opened file would get its descriptor.
            setattr(sys, name, open(os.devnull, "w"))
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _run(name: str, words: Sequence[str]) -> int:
    if name == "--version":
        if words:
            raise errors.UsageError(f"palpate --version takes no {words[0]}")
        from palpate.adapters.log import made_with

        sys.stdout.write("".join(f"{name} {number}\n" for name, number in made_with().items()))
        return 0
    group = name if name in GROUPS else ""
    if group:
        if not words or words[0] in ("-h", "--help"):
            sys.stdout.write(help_of(group))
            return 0
        name, words = words[0], words[1:]
    known = commands_of(group)
    if name not in known:
        import difflib

        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise errors.UsageError(
            f"{name} is not a command of {f'palpate {group}'.rstrip()}; {hint}the commands are {', '.join(known)}"
        )
    # Import the command only after checking its arguments, because it may load the simulator.
    from palpate.adapters.cli.arguments import parse

    whole = f"{group} {name}".lstrip()
    options: object = parse(options_of(whole), whole, words)
    code = function_of(whole)(options)
    return code if isinstance(code, int) else 0


if __name__ == "__main__":
    sys.exit(main())
