"""Whose fault the silence of a loop is, by the system's accounts."""

import os
import threading
import time
from pathlib import Path

import pytest

from palpate.adapters.hardware.real_time import LoopAccount
from tests.unit.adapters.hardware.watchdogs.bench import wait_for


def note(folder: Path, state: str, run_s: float, delay_s: float, stolen_s: float = 0.0) -> None:
    task = folder / "7" / "task" / "9"
    task.mkdir(parents=True, exist_ok=True)
    (task / "stat").write_text(f"9 (a) loop) {state}{' 1' * 35} 2 1\n")
    (task / "schedstat").write_text(f"{run_s * 1e9:.0f} {delay_s * 1e9:.0f} 3\n")
    ticks = round(stolen_s * os.sysconf("SC_CLK_TCK"))
    (folder / "stat").write_text(f"cpu{' 1' * 7} {ticks}\ncpu0{' 1' * 10}\ncpu2{' 1' * 7} {ticks} 0 0\nintr 4\n")


PASSED_S = 10.0


@pytest.mark.parametrize(
    ("state", "run_s", "delay_s", "stolen_s", "whose"),
    [
        ("T", 0.0, 0.0, 0.0, "is stopped, by SIGSTOP or Ctrl-Z (the operator's fault)"),
        ("S", 0.0, 9.0, 0.0, "this computer was late: it gave the loop no processor for 9000 of the last"),
        ("R", 0.0, 0.0, 0.0, "(this computer's fault)"),
        ("R", 9.0, 0.0, 0.0, "busy with something else for 9000 of the last 10000 ms"),
        ("S", 0.0, 0.0, 0.0, "waited for something"),
        # Most of the time counts, not half of it.
        ("S", 2.0, 4.5, 0.0, "no processor for 4500 of the last 10000 ms (this computer's fault)"),
        ("S", 4.5, 3.0, 0.0, "for 4500 of the last 10000 ms, without a processor for 3000 (our software's fault"),
        # What a hypervisor took looks like work.
        ("S", 9.0, 0.0, 8.0, "no processor for 8000 of the last 10000 ms (this computer's fault)"),
    ],
)
def test_the_system_s_account_says_whose_fault_it_is(
    state: str, run_s: float, delay_s: float, stolen_s: float, whose: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    account = LoopAccount(7, tmp_path)
    note(tmp_path, "S", 100.0, 50.0, 20.0)
    monkeypatch.setattr(time, "monotonic_ns", lambda: 0)
    account.look(9)
    note(tmp_path, state, 100.0 + run_s, 50.0 + delay_s, 20.0 + stolen_s)
    monkeypatch.setattr(time, "monotonic_ns", lambda: int(PASSED_S * 1e9))
    assert whose in account.explanation(9)


def test_without_an_account_nobody_is_blamed(tmp_path: Path) -> None:
    account = LoopAccount(7, tmp_path)
    account.look(9)
    assert "not known" in account.explanation(9)
    note(tmp_path, "S", 1.0, 1.0)
    assert "not known" in account.explanation(9)


def test_the_system_keeps_such_an_account_of_a_thread_that_waits() -> None:
    account, end = LoopAccount(os.getpid()), threading.Event()
    thread = threading.Thread(target=end.wait, daemon=True)
    thread.start()

    def waited() -> bool:
        account.look(thread.native_id or 0)
        time.sleep(0.05)
        return "waited for something" in account.explanation(thread.native_id or 0)

    # A hypervisor may take the processor meanwhile, and then the account says so.
    wait_for(waited)
    end.set()
    thread.join()
