"""The server's thread on a computer that holds it up."""

from itertools import chain, count, pairwise
from types import SimpleNamespace

import pytest

from palpate.simulation.emulators.ur import UrController, UrServer, server
from palpate.simulation.emulators.ur.controller import CYCLE_NS


def test_cycles_that_are_made_up_for_are_as_long_as_others(monkeypatch: pytest.MonkeyPatch) -> None:
    times_ns: list[int] = []

    class Recording(UrController):
        def step(self, now_ns: int) -> None:
            times_ns.append(now_ns)
            emulator._end = len(times_ns) == 8

    # Held up for nine cycles once, and then as quick as can be.
    now_ns = chain([0, 0, 0], count(9 * CYCLE_NS, 1000))
    monkeypatch.setattr(server, "time", SimpleNamespace(monotonic_ns=lambda: next(now_ns), sleep=lambda seconds: None))
    emulator = UrServer(Recording((0.0,) * 6, lambda now_ns: (0.0,) * 6))
    emulator.network.is_stalled = True
    emulator._serve()
    assert {later - sooner for sooner, later in pairwise(times_ns)} == {CYCLE_NS}
