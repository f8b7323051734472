"""Signals that end a process: which are handled, and which keep their meaning."""

import signal
import subprocess
import sys

import pytest

from palpate.adapters.signals import ENDING, on_ending_signal

CRASHES = ("SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL", "SIGABRT", "SIGTRAP", "SIGSYS")
OF_PYTHON = ("SIGPIPE", "SIGXFSZ")
HARMLESS = ("SIGCHLD", "SIGCONT", "SIGTSTP", "SIGTTIN", "SIGTTOU", "SIGURG", "SIGWINCH")
NOT_CAUGHT = ("SIGKILL", "SIGSTOP")


def test_every_signal_that_ends_a_process_is_on_the_list():
    others = {signal.Signals[name] for name in (*CRASHES, *OF_PYTHON, *HARMLESS, *NOT_CAUGHT)}
    assert set(ENDING) == signal.valid_signals() - others


def test_each_of_them_is_handled_and_the_innermost_handler_counts():
    outer = []
    inner = []
    # The time limit of the tests serves SIGALRM.
    numbers = [number for number in ENDING if number != signal.SIGALRM]
    before = [signal.getsignal(number) for number in ENDING]
    with on_ending_signal(outer.append):
        with on_ending_signal(inner.append):
            for number in numbers:
                signal.raise_signal(number)
        signal.raise_signal(signal.SIGHUP)
    assert (inner, outer) == (numbers, [signal.SIGHUP])
    assert [signal.getsignal(number) for number in ENDING] == before


@pytest.mark.parametrize("meaning", [signal.SIG_IGN, lambda number, frame: None])
def test_ignored_signal_and_one_with_a_handler_stay(meaning):
    seen = []
    before = signal.signal(signal.SIGHUP, meaning)
    try:
        with on_ending_signal(seen.append):
            assert signal.getsignal(signal.SIGHUP) is meaning
    finally:
        signal.signal(signal.SIGHUP, before)
    assert seen == []


def test_process_that_works_for_another_outlives_them_all():
    program = (
        "import signal\n"
        "from palpate.adapters.signals import ENDING, ignore_ending_signals\n"
        "ignore_ending_signals()\n"
        "[signal.raise_signal(number) for number in ENDING]\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
