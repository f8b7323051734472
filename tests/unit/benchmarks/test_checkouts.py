"""A checkout's own metadata, written for Python to find."""

from importlib.metadata import distributions
from pathlib import Path

from benchmarks.checkouts import import_path

PROJECT = """
[project]
name = "palpate"
version = "0.1.0"

[project.scripts]
palpate = "palpate.adapters.cli.main:main"

[project.entry-points."palpate.adapters"]
"arm.zebra-nmc" = "palpate.adapters.zebra_ports:make_zebra_nmc"
"""


def test_entry_points_are_those_of_the_checkout(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(PROJECT)
    path = import_path(tmp_path, tmp_path / "metadata")
    assert path[1:] == [str(tmp_path / root) for root in ("core", "adapters", "drivers", "simulation")]
    (found,) = distributions(path=path)
    assert (found.name, found.version) == ("palpate", "0.1.0")
    assert {(point.group, point.name, point.value) for point in found.entry_points} == {
        ("console_scripts", "palpate", "palpate.adapters.cli.main:main"),
        ("palpate.adapters", "arm.zebra-nmc", "palpate.adapters.zebra_ports:make_zebra_nmc"),
    }
