"""What a shell completes, and ``palpate replay --watch``."""

import shlex
import subprocess
from pathlib import Path

from palpate.adapters.cli.arguments import parse
from palpate.adapters.cli.options import ReplayOptions
from palpate.adapters.cli.watch import repeat, stamps, words_of
from tests.command_line import CommandLine

COMPLETED = {
    "tr": "train",
    "log ex": "export",
    "log export --f": "--fps",
    "train --out runs/x --see": "--seed",
    "show ": "",
    "replay logs/ --wat": "--watch",
    "nothing --se": "",
}


def test_bash_completes_commands_and_flags_and_leaves_files_to_itself(palpate: CommandLine) -> None:
    script = palpate.succeed("completion")
    for typed in COMPLETED:
        words = " ".join(shlex.quote(word) for word in ("palpate", *typed.split(" ")))
        script += f'COMP_WORDS=({words}); COMP_CWORD={typed.count(" ") + 1}; _palpate; echo "${{COMPREPLY[*]}}"\n'
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == list(COMPLETED.values())


def test_a_replay_is_repeated_when_the_source_changes_until_ctrl_c(tmp_path: Path) -> None:
    source, codes, waits = tmp_path / "core.py", iter((0, 1)), 0
    source.write_text("a")

    def pause(_: float) -> None:
        nonlocal waits
        waits += 1
        if waits == 2:
            source.write_text("b")
            (tmp_path / "new.py").write_text("c")
        if waits == 4:
            raise KeyboardInterrupt

    assert repeat(lambda: next(codes), lambda: stamps([tmp_path]), pause) == 1
    assert next(codes, None) is None


def test_it_replays_what_was_asked_for_and_writes_nothing_twice(palpate: CommandLine) -> None:
    words = ["a.mcap", "logs", "--set", "task.max_force_N=8", "--set", "seed=1", "--policy", "torque", "--strict"]
    assert list(words_of(parse(ReplayOptions, "replay", [*words, "--watch"]))) == [
        "a.mcap", "logs", "--policy", "torque", "--set", "task.max_force_N=8", "--set", "seed=1", "--strict",
    ]  # fmt: skip
    assert "--watch with --out" in palpate.refusal("replay", "a.mcap", "--watch", "--out", "b")
