"""The shape of the package: one namespace over four source roots, typed, and quick to import."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
LAYERS = ("core", "adapters", "drivers", "simulation")
HEAVY = ("mujoco", "torch", "sklearn", "minisom", "matplotlib", "scipy.signal", "can", "serial", "gymnasium")

layers = pytest.mark.parametrize("layer", LAYERS)


def imported_by(code: str) -> dict[str, Any]:
    """What a fresh interpreter has loaded after some code: the heavy modules, and the number of palpate's own."""
    program = (
        f"import sys, json\nsys.path[:0] = {[str(ROOT / layer) for layer in LAYERS]!r}\n{code}\n"
        f"heavy = [name for name in {HEAVY!r} if name in sys.modules]\n"
        "own = [name for name in sys.modules if name.startswith('palpate.')]\n"
        "print(json.dumps({'heavy': heavy, 'own': own}))"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    loaded: dict[str, Any] = json.loads(done.stdout)
    return loaded


@layers
def test_no_root_claims_the_namespace_for_itself(layer: str) -> None:
    # With one __init__.py here the other three roots would vanish.
    assert (ROOT / layer / "palpate").is_dir()
    assert not (ROOT / layer / "palpate" / "__init__.py").exists()
    assert [p.name for p in (ROOT / layer).iterdir() if p.suffix == ".py"] == []


@layers
def test_a_root_holds_its_own_layer_only(layer: str) -> None:
    packages = [p.name for p in (ROOT / layer / "palpate").iterdir() if p.name != "__pycache__"]
    assert packages == [layer]


@layers
def test_every_layer_is_marked_as_typed(layer: str) -> None:
    assert (ROOT / layer / "palpate" / layer / "py.typed").is_file()


def test_the_wheel_takes_all_layers() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert sorted(wheel) == sorted(f"{layer}/palpate" for layer in LAYERS)
    assert sorted(project["tool"]["hatch"]["build"]["dev-mode-dirs"]) == sorted(LAYERS)


def test_importing_the_core_loads_nothing_heavy() -> None:
    loaded = imported_by("import palpate.core")
    assert loaded["heavy"] == []


def test_importing_every_module_of_the_core_loads_nothing_heavy() -> None:
    loaded = imported_by(
        "import importlib, pkgutil, palpate.core\n"
        "for module in pkgutil.walk_packages(palpate.core.__path__, 'palpate.core.'):\n"
        "    importlib.import_module(module.name)"
    )
    assert loaded["heavy"] == []
    assert len(loaded["own"]) > 40
    assert {name.split(".")[1] for name in loaded["own"]} == {"core"}


def test_a_heavy_module_would_be_noticed() -> None:
    assert imported_by("import scipy.signal")["heavy"] == ["scipy.signal"]
