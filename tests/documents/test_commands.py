"""Run every command in README and docs with fewer trials, except those listed below with the reason.

Commands run in the order of their page, in the folder that `desk` prepares; those of two pages run in test_docs.py.
"""

import re
import shlex
import shutil
from glob import glob
from itertools import groupby

import pytest

from tests.integration.test_docs import PAGES, ROOT, commands_in
from tests.support.graphics import require_graphics

NEEDS = {
    r"palpate (train|run|rig doctor|rig calibrate) .*--rig": "a device, or an emulator beside it; tests/wall_clock",
    r"palpate (train|run) .*--live": "a viewer, and a port of its own; tests/wall_clock/test_live.py",
    r"palpate emulate": "goes on until Ctrl-C; tests/wall_clock",
    r"palpate run .*--view": "a display; tests/cli/test_view.py",
    r"palpate study |--trials 10000": "minutes; tests/cli/test_study.py, test_run.py",
    r"palpate report runs/(clearance|start-uncertainty)": "what minutes leave; tests/cli/test_report.py",
    r"palpate train .*(--from-logs|runs/touch/)": "recorded insertions; tests/cli/test_train_from_logs.py",
    r"palpate (infer runs/walks/|train .* runs/felt/)": "recorded insertions; tests/cli/test_automaton.py",
    r"palpate rig check |python -m third_party_rig": "a package of examples; tests/cli/test_rig_check.py",
    r"palpate (run --task surface-follow|replay runs/follow)": "a package; tests/integration/test_surface_follow.py",
    r"pytest --palpate-logs": "another repository; tests/integration/test_pytest_plugin.py",
    r"make |python -m benchmarks\.|python examples/": "minutes, or packages of its own",
}
"""What is not run here, and why."""

TRIALS = ("--task.time-limit-s", "0.5", "--trials", "1")
FEW = {
    "train": TRIALS,
    "run": TRIALS,
    "compare": TRIALS,
    "plan": ("--trials", "0"),
    "explore": ("--trials", "30", "--seeds", "1"),
    "infer": ("--training.restarts", "8", "--training.batch", "8", "--training.steps", "60",
              "--extraction.most-intervals", "6"),
    "render": ("--size", "480x376"),
}  # fmt: skip
"""Words that keep a command short, in place of the page's own."""


COMMANDS_SHOWN = [
    (page, line) for page in PAGES if page.stem not in ("tutorial", "your-own-policy") for line in commands_in(page)
]
RUN = [pair for pair in COMMANDS_SHOWN if not any(re.match(need, pair[1]) for need in NEEDS)]


@pytest.mark.parametrize("page", [page for page, _ in groupby(RUN, lambda pair: pair[0])], ids=lambda page: page.stem)
def test_commands_of_a_page_run(palpate, desk, page):
    for line in (line for where, line in RUN if where == page):
        assert line.startswith("palpate "), f"no test runs {line!r} of {page.name}: list what it needs in NEEDS"
        # Patterns are a shell's to fill in.
        words = [name for word in shlex.split(short(line))[1:] for name in (sorted(glob(word)) or [word])]
        done = palpate(*words)
        # A what-if that goes otherwise says so by 1.
        assert done.code in ((0, 1) if re.search("--set|--policy other", line) else (0,)), (line, done)


def short(line):
    """The same command with the words that keep it short."""
    words = FEW.get(line.split()[1], ())
    for flag in words[::2]:
        line = re.sub(rf" {re.escape(flag)} \S+", "", line)
    return " ".join((line, *words))


@pytest.fixture
def desk(palpate, tmp_path):
    """Prepare the files that the pages use: a run, logs, a policy, jobs."""
    require_graphics()
    golden = ROOT / "tests" / "golden"
    palpate.succeed("train", "--task.time-limit-s", "0.5", "--trials", "3", "--out", tmp_path / "runs" / "paper")
    log = tmp_path / "runs" / "paper" / "logs" / "trial-00002.mcap"
    shutil.copy(log, log.with_name("trial-00003.mcap"))
    (tmp_path / "trials").mkdir()
    for name in ("trial-00012.mcap", "trials/trial-00012.mcap"):
        shutil.copy(golden / "torque-ur5.mcap", tmp_path / name)
    shutil.copy(tmp_path / "runs" / "paper" / "policy.json", tmp_path / "other.json")
    shutil.copytree(ROOT / "examples" / "jobs", tmp_path / "examples" / "jobs")
    shutil.copy(ROOT / "examples" / "jobs" / "paper-peg.toml", tmp_path / "job.toml")
