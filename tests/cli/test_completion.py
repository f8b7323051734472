"""What a shell completes."""

import shlex
import subprocess

COMPLETED = {
    "tr": "train",
    "log ex": "export",
    "log export --o": "--out",
    "train --out runs/x --see": "--seed",
    "replay logs/ --stri": "--strict",
    "nothing --se": "",
}


def test_bash_completes_commands_and_flags(palpate):
    script = palpate.succeed("--tyro-print-completion", "bash")
    for typed in COMPLETED:
        words = " ".join(shlex.quote(word) for word in ("palpate", *typed.split(" ")))
        script += f'COMP_WORDS=({words}); COMP_CWORD={typed.count(" ") + 1}; _tyro_palpate; echo "${{COMPREPLY[*]}}"\n'
    done = subprocess.run(["bash"], input=script, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == list(COMPLETED.values())
