"""The corpora of the fuzz harnesses, through codecs and whole drivers, and how each input must end."""

from collections import Counter

import pytest

from benchmarks.fuzz_targets import cia402, jr3, nmc
from benchmarks.fuzzing import CORPORA

HARNESSES = {"cia402": cia402.once, "nmc": nmc.once, "jr3_can": jr3.once}
INPUTS = [(name, path) for name in HARNESSES for path in sorted((CORPORA / name).iterdir())]
FAULTED = {"astray", "boot", "emergency", "fault_state", "mute", "stopped"}
SILENT = {"heartbeat", "orphans", "kinds", "other_node", "host", "short", "bad_state", "echo", "noise"}


@pytest.mark.parametrize(("name", "path"), INPUTS, ids=lambda value: getattr(value, "name", value))
def test_inputs_of_the_corpora(name, path):
    came_of_it = HARNESSES[name](path.read_bytes())
    if name == "cia402":
        assert came_of_it == ("faulted" if path.name in FAULTED else "enabled")
    elif name != "nmc":
        assert bool(came_of_it) is (path.name not in SILENT)


def test_corpora_are_there():
    assert all(10 <= count <= 40 for count in Counter(name for name, _ in INPUTS).values())
    assert [HARNESSES[name](b"") for name in ("cia402", "jr3_can")] == ["enabled", []]
