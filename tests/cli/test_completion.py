"""What a shell completes."""

import shlex
import subprocess

from tests.command_line import CommandLine

COMPLETED = {
    "tr": "train",
    "log ex": "export",
    "log export --f": "--fps",
    "train --out runs/x --see": "--seed",
    "show ": "",
    "replay logs/ --stri": "--strict",
    "nothing --se": "",
}


def test_bash_completes_commands_and_flags_and_leaves_files_to_itself(palpate: CommandLine) -> None:
    script = palpate.succeed("completion")
    for typed in COMPLETED:
        words = " ".join(shlex.quote(word) for word in ("palpate", *typed.split(" ")))
        script += f'COMP_WORDS=({words}); COMP_CWORD={typed.count(" ") + 1}; _palpate; echo "${{COMPREPLY[*]}}"\n'
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == list(COMPLETED.values())
