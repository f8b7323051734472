"""Settings for all tests."""

import copy
import gc
import json
import os
import signal
import sys
from functools import cache
from importlib import import_module

import pytest
from _pytest.runner import runtestprotocol
from hypothesis import settings
from xdist.scheduler import LoadGroupScheduling

from palpate.adapters.config import plugins
from palpate.adapters.experiments import evaluation, learning_curve, third_party, training
from palpate.adapters.log import decisive, processor, read_log, timeline
from palpate.simulation.work_cell import build_work_cell
from tests.golden.record import HERE as GOLDEN
from tests.golden.record import record
from tests.wall_clock.late import TooLateError

pytest_plugins = ["tests.command_line"]

# The same examples at every run, and no stopwatch: a busy machine must not fail a property.
settings.register_profile("palpate", max_examples=50, deadline=None, derandomize=True)
settings.load_profile("palpate")

WALL_CLOCK = "tests/wall_clock/"
"""The folder of the tests that run against the wall clock."""
WITH_PROCESSES = f"{WALL_CLOCK}test_rigs.py"
"""Those that get a worker of their own: an emulated rig and a run keep a processor busy for seconds."""
TOGETHER = "tests/unit/adapters/log/test_trial_recorder.py"
"""Tests that share what takes seconds to make: two workers would make it twice."""
WITH_TORCH = (
    "tests/unit/core/automata/",
    "tests/cli/test_automaton.py",
    "tests/integration/test_examples.py::test_infer_automaton",
    "tests/integration/test_third_party_policies.py::test_a_network_of_torchscript",
)
"""Tests for which PyTorch is loaded, in two seconds of a processor: one worker does it."""
MOST_TRIES = 3
"""Of a test against the wall clock that comes too late."""
MIXED = pytest.StashKey[bool]()
"""Whether some of the tests run against the wall clock, and some do not."""


@pytest.fixture(scope="session", autouse=True)
def _once():
    """Make once per process what takes long and is not tested where it is used: pictures, models, what is installed."""
    models = {}
    picture = cache(lambda: learning_curve([], ""))
    forces, found = list[bytes](), cache(lambda path, group: plugins_of(group=group))
    plugins_of, distributions = plugins.entry_points, cache(lambda: third_party_names(tuple(sys.path)))
    third_party_names = third_party._distributions

    def one_timeline(log):
        forces[:] = forces or [timeline(log)]
        return forces[0]

    def one_model(kinematics, config, *, goal_in_base, **more):
        key = (kinematics.arm, kinematics.tool, config, goal_in_base.homogeneous.tobytes(), *more.items())
        if key not in models:
            models[key] = build_work_cell(kinematics, config, goal_in_base=goal_in_base, **more)
        return copy.copy(models[key])

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("palpate.simulation.work_cell.cell.build_work_cell", one_model)
        patched.setattr(training, "learning_curve", lambda *_: picture())
        patched.setattr(evaluation, "trials_picture", lambda *_: picture())
        patched.setattr(import_module("palpate.adapters.visualisation.report.run_page"), "timeline", one_timeline)
        patched.setattr(plugins, "entry_points", lambda group: found(tuple(sys.path), group))
        patched.setattr(third_party, "_distributions", lambda path: distributions())
        yield


@pytest.fixture(scope="session")
def golden_here(tmp_path_factory):
    """A golden log that holds the very bits that this machine gives.

    That is the one in the repository, unless this machine's sines may differ from those of the machine that recorded
    it: then the same commands have recorded another.
    """

    @cache
    def find(name):
        kept = GOLDEN / f"{name}.mcap"
        if decisive(json.loads(read_log(kept).start.processor_json)) == decisive(processor()):
            return kept
        own = tmp_path_factory.mktemp("golden") / kept.name
        record(name, own)
        return own

    return find


def pytest_configure():
    """Wait for no disk, and take signals also in the background of a script or under nohup, where they are ignored."""
    for number in (signal.SIGINT, signal.SIGQUIT, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    # What tests write need not outlast a power cut.
    os.fsync = lambda fd: None
    # Little garbage is cyclic; to look for it takes 5 % of the time.
    gc.set_threshold(100_000, 50, 50)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect tests without collecting garbage: all that is made stays, and is never looked through."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_finish(session):
    """Note whether tests that run against the wall clock are among others."""
    session.config.stash[MIXED] = len({item.nodeid.startswith(WALL_CLOCK) for item in session.items}) > 1


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Let tests against the wall clock go before others where both run. Only root may take a low priority back."""
    if item.config.stash[MIXED] and os.geteuid() == 0:
        os.setpriority(os.PRIO_PROCESS, 0, 0 if item.nodeid.startswith(WALL_CLOCK) else 10)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item, nextitem):
    """Try a test against the wall clock again where it came too late: the host may be late, but not each time."""
    if not item.nodeid.startswith(WALL_CLOCK):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for _ in range(MOST_TRIES):
        reports = runtestprotocol(item, log=False, nextitem=nextitem)
        if not any(report.failed and TooLateError.__name__ in report.longreprtext for report in reports):
            break
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def pytest_xdist_make_scheduler(config, log):
    """Hand out tests by our own rule, see :class:`OneRigOnTheWallClock`."""
    return OneRigOnTheWallClock(config, log)


class OneRigOnTheWallClock(LoadGroupScheduling):
    """Tests that run against the wall clock go first, and at most two at once: one with a rig's processes, one without.

    Two rigs at once would starve each other. pytest-xdist's own grouping passes the group's name in the tests' names,
    which pytest 9 no longer lets it change.
    """

    def _split_scope(self, nodeid):
        if nodeid.startswith(WITH_PROCESSES):
            return "with a rig's processes"
        if nodeid.startswith(WITH_TORCH):
            return "with PyTorch"
        if nodeid.startswith(TOGETHER):
            return TOGETHER
        return WALL_CLOCK if nodeid.startswith(WALL_CLOCK) else str(super()._split_scope(nodeid))
