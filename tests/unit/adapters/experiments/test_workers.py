"""Workers end with the process that began them, however it ends, and leave Ctrl-C to it."""

import signal
import subprocess
import sys

from palpate.adapters.experiments.workers import interrupts_wait

KILLED = """
import os
from palpate.adapters.experiments import in_processes
print(list(in_processes(divmod, [(7, 2), (9, 2)], 2)), flush=True)
os.kill(os.getpid(), 9)
"""


def test_workers_do_not_outlive_a_process_that_was_killed() -> None:
    # They hold its output: reading ends with the last of them.
    done = subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (-signal.SIGKILL, "[(3, 1), (4, 1)]\n")


def test_a_process_that_is_begun_meanwhile_does_not_see_ctrl_c() -> None:
    program = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    with interrupts_wait():
        held = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert held.stdout == "True\n"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
