"""The shape of the package: one namespace over four source roots, typed, and quick to import."""

import ast
import importlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LAYERS = ("core", "adapters", "drivers", "simulation")
HEAVY = ("mujoco", "torch", "sklearn", "minisom", "matplotlib", "scipy.signal", "can", "serial", "gymnasium")


def imported_by(code):
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
    return json.loads(done.stdout)


@pytest.mark.parametrize("layer", LAYERS)
def test_root_holds_its_own_layer_only(layer):
    # With one __init__.py in palpate/ the other three roots would vanish.
    assert [p.name for p in (ROOT / layer).iterdir() if p.suffix == ".py"] == []
    packages = {p.name for p in (ROOT / layer / "palpate").iterdir() if p.name != "__pycache__"}
    assert packages == {layer}


def test_importing_every_module_of_the_core_loads_nothing_heavy():
    loaded = imported_by(
        "import importlib, pkgutil, palpate.core\n"
        "for module in pkgutil.walk_packages(palpate.core.__path__, 'palpate.core.'):\n"
        "    importlib.import_module(module.name)"
    )
    assert loaded["heavy"] == []
    assert len(loaded["own"]) > 40
    assert {name.split(".")[1] for name in loaded["own"]} == {"core"}


def imports_in(path):
    """Module and name of every import from palpate in a file."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("palpate."):
            found += [(str(node.module), alias.name) for alias in node.names]
    return found


def faces():
    """The stubs of all rooms that have a face, by the room's dotted name."""
    found = {}
    for layer in LAYERS:
        for stub in (ROOT / layer / "palpate").rglob("__init__.pyi"):
            found[".".join(stub.relative_to(ROOT / layer).parent.parts)] = stub
    return found


def test_nobody_imports_past_the_face_of_a_room():
    past = []
    rooms = faces()
    assert len(rooms) > 20
    sources = [path for layer in LAYERS for path in (ROOT / layer).rglob("*.py")]
    for path in [*sources, *(ROOT / "examples").rglob("*.py")]:
        own = ".".join(path.relative_to(ROOT).with_suffix("").parts[1:])
        for module, name in imports_in(path):
            behind = [room for room in rooms if module.startswith(f"{room}.") and not own.startswith(f"{room}.")]
            if behind and module not in rooms:
                past.append(f"{path.relative_to(ROOT)}: {module}.{name}")
    assert past == [], "\n".join(past)


def test_every_name_of_a_face_is_there():
    modules = [importlib.import_module(room) for room in faces()]
    assert [module.__name__ for module in modules if not module.__all__] == []
    assert [name for module in modules for name in module.__all__ if getattr(module, name) is None] == []


def test_slim_install_pins_what_palpate_needs_but_for_what_it_leaves_out():
    lines = (ROOT / "requirements" / "robot.txt").read_text().splitlines()
    pins = dict(line.lower().replace("_", "-").split("==") for line in lines if line and not line.startswith("#"))
    constraints = (ROOT / "constraints.txt").read_text().lower().replace("_", "-")
    known = dict(line.split("==") for line in constraints.splitlines() if "==" in line)
    assert {name: pin for name, pin in pins.items() if known.get(name) != pin} == {}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needed = {re.split("[>=]", one)[0].replace("_", "-") for one in project["dependencies"]}
    assert needed - set(pins) == {"torch", "example-robot-data"}
