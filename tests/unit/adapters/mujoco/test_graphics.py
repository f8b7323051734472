import subprocess

import pytest

from palpate.adapters.mujoco import graphics
from palpate.core.errors import UsageError


def only(*working):
    return lambda library: "" if library in working else f"no {library} here"


def test_the_first_that_works_is_taken(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    for working, taken in ((("egl", "osmesa"), "egl"), (("egl",), "egl"), (("osmesa",), "osmesa")):
        monkeypatch.setattr(graphics, "problem_with", only(*working))
        assert graphics.working_library() == taken


def test_the_environment_chooses(monkeypatch):
    monkeypatch.setattr(graphics, "problem_with", only("egl", "osmesa"))
    for named, taken in (("osmesa", "osmesa"), ("EGL", "egl"), ("glfw", "egl"), ("", "egl")):
        monkeypatch.setenv("MUJOCO_GL", named)
        assert graphics.working_library() == taken


def test_without_any_the_packages_are_named(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(graphics, "problem_with", only())
    with pytest.raises(UsageError, match=r"no egl here.*no osmesa here.*libegl1 and libgl1-mesa-dri.*libosmesa6"):
        graphics.working_library()


def test_a_library_is_tried_in_a_process_of_its_own():
    assert "No module named 'mujoco.nothing'" in graphics.problem_with("nothing")


def test_a_library_that_hangs_or_crashes_is_no_library(monkeypatch):
    def hang(*words, **more):
        raise subprocess.TimeoutExpired("python", 1.0)

    monkeypatch.setattr(subprocess, "run", hang)
    assert graphics.problem_with("egl") == "does not answer"
    monkeypatch.setattr(subprocess, "run", lambda *words, **more: subprocess.CompletedProcess([], -11, "", ""))
    assert graphics.problem_with("egl") == "ended with -11"
