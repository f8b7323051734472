"""Folders that commands leave, made once for the tests of all workers; to be read, or copied and changed."""

import shutil

import pytest

from tests.command_line import STUDY, CommandLine, shared_folder

TRIALS = 3


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """A finished training run of three recorded trials, one of them longer than the others."""

    def make(out):
        CommandLine().succeed("train", "--task.time-limit-s", 2, "--trials", TRIALS, "--out", out)

    return shared_folder(tmp_path_factory, "trained", make)


@pytest.fixture
def run(trained, tmp_path):
    """A copy of it that may be changed: ``run`` in the working directory."""
    return shutil.copytree(trained, tmp_path / "run")


@pytest.fixture(scope="session")
def compared(tmp_path_factory, trained):
    """A comparison of two trained policies, whose folders have one name, with the hand-written strategies."""

    def make(out):
        policies = [out.parent / f"{out.name}-{place}" / "run" / "policy.json" for place in ("a", "b")]
        for policy in policies:
            policy.parent.mkdir(parents=True)
            shutil.copy(trained / "policy.json", policy)
        words = ("--task.time-limit-s", 0.6, "--trials", 2, "--out", out, "--policy", *policies)
        printed = CommandLine().succeed("compare", *words)
        (out.parent / f"{out.name}.txt").write_text(printed)

    return shared_folder(tmp_path_factory, "compared", make)


@pytest.fixture(scope="session")
def studied(tmp_path_factory):
    """The folder of a small study; to be read, not changed."""

    def make(out):
        out.with_suffix(".toml").write_text(STUDY)
        CommandLine().succeed("study", out.with_suffix(".toml"), "--out", out, "--jobs", 1)

    return shared_folder(tmp_path_factory, "studied", make)
