"""Entry point: picks the subcommand, turns errors into one line and an exit code."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from palpate.core.errors import ConfigurationError, LogError, OutputError, PalpateError, UsageError

HELP = """usage: palpate COMMAND [OPTIONS]

A robot arm learns contact tasks by touch.

commands:
  train          learn an insertion by trial; leaves a folder with policy, trials and learning curve
  run            run a trained policy, or a comparator, without learning
  compare        table of hand-written strategies and trained policies on the same trials
  study          many runs: settings, policies and seeds from one file, on several processes or a Dask cluster
  show           print what a policy file knows
  explore        learn in a grid world with an ambiguous sensor, and hold it against the optimum
  infer          an automaton from symbol strings, or from what recorded trials felt
  automaton      show, compare or minimise automata
  replay         feed recorded trials back through the core; every command and decision must be equal
  report         one page about a run or a study, with its pictures, to be read in a browser
  log            look at recorded trials: info, plot, export, recover
  render         a film or a picture of a recorded trial
  view           watch trials in the simulator, in real time
  check-adapter  try the contract of a port on an adapter of your own
  emulate        serve the simulated cell behind emulated serial and CAN wires
  doctor         examine the devices of a rig, and say how to mend what is wrong
  faults         trials in which something goes wrong on purpose, and what came of each
  version        versions of palpate and of what its results depend on

palpate COMMAND --help tells the options of each. To begin: palpate train
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0: done; 1: the run failed; 2: something in the call, a file or a folder is wrong; 130: ended by Ctrl-C.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    commands: dict[str, Callable[[Sequence[str]], int]] = {
        "train": _train,
        "run": _run,
        "compare": _compare,
        "study": _study,
        "show": _show,
        "explore": _explore,
        "infer": _infer,
        "automaton": _automaton,
        "replay": _replay,
        "report": _report,
        "log": _log,
        "render": _render,
        "view": _view,
        "check-adapter": _check_adapter,
        "emulate": _emulate,
        "doctor": _doctor,
        "faults": _faults,
        "version": _version,
    }
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(HELP)
        return 0
    if words[0] == "--version":
        words[0] = "version"
    try:
        if words[0] not in commands:
            raise UsageError(f"{words[0]} is no command of palpate; there are {', '.join(commands)}")
        return commands[words[0]](words[1:])
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


# Each command imports what it needs when it runs: `palpate --help` loads neither simulator nor kinematics.


def _train(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import TrainOptions, parse

    options = parse(TrainOptions, "train", words)
    from palpate.adapters.cli.train import train

    return train(options)


def _run(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import RunOptions, parse

    options = parse(RunOptions, "run", words)
    from palpate.adapters.cli.run import run

    return run(options)


def _compare(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import CompareOptions, parse

    options = parse(CompareOptions, "compare", words)
    from palpate.adapters.cli.compare import compare

    return compare(options)


def _study(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import parse
    from palpate.adapters.cli.study_options import StudyOptions

    options = parse(StudyOptions, "study", words)
    from palpate.adapters.cli.study import study

    return study(options)


def _show(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import ShowOptions, parse

    options = parse(ShowOptions, "show", words)
    from palpate.adapters.cli.show import show

    return show(options)


def _explore(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import ExploreOptions, parse

    options = parse(ExploreOptions, "explore", words)
    from palpate.adapters.cli.explore import explore

    return explore(options)


def _infer(words: Sequence[str]) -> int:
    from palpate.adapters.cli.automaton_options import InferOptions
    from palpate.adapters.cli.options import parse

    options = parse(InferOptions, "infer", words)
    from palpate.adapters.cli.infer import infer_command

    return infer_command(options)


def _automaton(words: Sequence[str]) -> int:
    from palpate.adapters.cli.automaton import automaton

    return automaton(words)


def _replay(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import ReplayOptions, parse

    options = parse(ReplayOptions, "replay", words)
    from palpate.adapters.cli.replay import replay

    return replay(options)


def _report(words: Sequence[str]) -> int:
    from palpate.adapters.cli.report import report

    return report(words)


def _log(words: Sequence[str]) -> int:
    from palpate.adapters.cli.log import log

    return log(words)


def _render(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import parse
    from palpate.adapters.cli.picture_options import RenderOptions

    options = parse(RenderOptions, "render", words)
    from palpate.adapters.cli.render import render

    return render(options)


def _view(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import parse
    from palpate.adapters.cli.picture_options import ViewOptions

    options = parse(ViewOptions, "view", words)
    from palpate.adapters.cli.view import view

    return view(options)


def _check_adapter(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import CheckAdapterOptions, parse

    options = parse(CheckAdapterOptions, "check-adapter", words)
    from palpate.adapters.cli.check_adapter import check_adapter

    return check_adapter(options)


def _doctor(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import DoctorOptions, parse

    options = parse(DoctorOptions, "doctor", words)
    from palpate.adapters.cli.doctor import doctor

    return doctor(options)


def _emulate(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import EmulateOptions, parse

    options = parse(EmulateOptions, "emulate", words)
    from palpate.adapters.cli.emulate import emulate

    return emulate(options)


def _faults(words: Sequence[str]) -> int:
    from palpate.adapters.cli.options import FaultsOptions, parse

    options = parse(FaultsOptions, "faults", words)
    from palpate.adapters.cli.faults import faults

    return faults(options)


def _version(words: Sequence[str]) -> int:
    if words:
        raise UsageError(f"palpate version takes no {words[0]}")
    from palpate.adapters.log.provenance import made_with

    sys.stdout.write("".join(f"{name} {version}\n" for name, version in made_with().items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
