"""What is shipped: the wheel has all that is needed, and works without the source tree."""

import re
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path, PurePosixPath

import pytest

from docs.site.build import repository

ROOT = Path(__file__).parents[2]
LAYERS = ("core", "adapters", "drivers", "simulation")

# In front of the editable install, whose source roots are taken off the path: a namespace is merged from all of it.
# A slim install has no torch.
FROM_WHEEL = f"""
import sys

class Left:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Left())
site, *words = sys.argv[1:]
roots = {[str(ROOT / layer) for layer in LAYERS]!r}
sys.path[:] = [site, *(folder for folder in sys.path if folder not in roots)]
"""


def call(*words, cwd):
    done = subprocess.run(
        [sys.executable, *map(str, words)], cwd=cwd, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    call("-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture
def site(wheel, tmp_path):
    """The wheel as pip installs it."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    return tmp_path / "site"


def names_in(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_every_source_file_is_in_it(wheel):
    sources = {
        path.relative_to(ROOT / layer).as_posix()
        for layer in LAYERS
        for path in (ROOT / layer / "palpate").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    code = {name for name in names_in(wheel) if ".dist-info/" not in name}
    assert code == sources
    assert sources >= {
        *(f"palpate/{layer}/py.typed" for layer in LAYERS),
        "palpate/core/motion/zebra_zero.urdf",
        "palpate/adapters/contracts/arm.py",
        "palpate/adapters/cli/main.py",
    }


def test_nothing_else_is_in_it(wheel):
    paths = [PurePosixPath(name) for name in names_in(wheel)]
    assert {path.parts[0] for path in paths} == {"palpate", f"palpate-{version('palpate')}.dist-info"}
    assert not [path for path in paths if path.stem.startswith("test_") or "tests" in path.parts]
    # Four layers share the name; whoever claimed it would hide an extension in another distribution.
    assert PurePosixPath("palpate/__init__.py") not in paths
    # With -W error, pytest does not start if a module of a distribution with a plug-in is already imported.
    assert PurePosixPath("palpate/__main__.py") not in paths


def test_it_says_what_it_is(wheel):
    info = f"palpate-{version('palpate')}.dist-info"
    with zipfile.ZipFile(wheel) as archive:
        metadata = archive.read(f"{info}/METADATA").decode()
        entry_points = archive.read(f"{info}/entry_points.txt").decode()
    assert "palpate = palpate.adapters.cli.main:main" in entry_points
    assert "Requires-Dist: mujoco==" in metadata
    assert f"{info}/licenses/LICENSE" in names_in(wheel)
    # While nobody has set the repository's address: no invented URL. In any case no link or picture that leads nowhere.
    assert ("Project-URL" in metadata) == bool(repository())
    assert not re.findall(r"\]\((?!http|#)", metadata)
    assert f"version: {version('palpate')}\n" in (ROOT / "CITATION.cff").read_text()


@pytest.mark.nightly
def test_slim_installed_it_is_on_its_own_trains_and_says_what_it_needs(site, tmp_path):
    (tmp_path / "strings.txt").write_text("a b a\nb a\na a b b\n" * 4)
    train = ["train", "--trials", "1", "--task.time-limit-s", "0.3", "--out", "run"]
    calls = (["--version"], train, ["show", "run/policy.json"], ["rig", "new", "--job"], ["replay", "run"],
             ["infer", "strings.txt", "--out", "automaton"])  # fmt: skip
    code = FROM_WHEEL + (
        f"import importlib, palpate\n"
        f"for layer in {LAYERS!r}:\n"
        f"    print(importlib.import_module('palpate.' + layer).__file__)\n"
        f"print(palpate.__path__[0])\n"
        f"from palpate.adapters.cli.main import main\n"
        f"sys.stderr = sys.stdout\n"
        f"print([main(words) for words in {calls!r}])\n"
    )
    printed = call("-I", "-c", code, site, cwd=tmp_path).splitlines()
    places = [*(str(site / "palpate" / layer / "__init__.py") for layer in LAYERS), str(site / "palpate")]
    assert printed[: len(places) + 1] == [*places, f"palpate {version('palpate')}"]
    assert any(line.startswith("17 states") for line in printed)
    assert any("1 of 1 equal" in line for line in printed)
    refused = "palpate: this needs torch, which is missing in a slim installation: pip install torch"
    assert printed[-2:] == [refused, "[0, 0, 0, 0, 0, 2]"]
