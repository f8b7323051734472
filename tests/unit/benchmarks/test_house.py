"""Rooms, arrows and floors of made-up checkouts."""

import json
from pathlib import Path

import pytest

from benchmarks.house import house, text


def build(checkout: Path, **files: str) -> Path:
    """A checkout with these files; ``adapters__log__reader`` stands for ``adapters/palpate/adapters/log/reader.py``."""
    for name, content in files.items():
        root, *parts = name.split("__")
        path = checkout.joinpath(root, "palpate", root, *parts).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return checkout


def test_arrows_are_between_rooms_of_one_root_however_they_are_imported(tmp_path: Path) -> None:
    build(
        tmp_path,
        core__values="",
        adapters__cli__main="import palpate.adapters.config\nfrom palpate.adapters.log import reader\n",
        adapters__cli__run="def run():\n    from palpate.adapters.plots import curve\n",
        adapters__log__reader="from ..config import X\nfrom . import file\nfrom palpate.core.values import Y\n",
        adapters__log__file="if TYPE_CHECKING:\n    from palpate.adapters.plots import Curve\n",
        adapters__config="import json\n",
        adapters__plots="",
    )
    adapters = house(tmp_path).roots["adapters"]
    assert adapters.rooms == ["cli", "config", "log", "plots"]
    assert adapters.arrows == {"cli": ["config", "log", "plots"], "log": ["config", "plots"]}
    assert (adapters.arrow_count, adapters.floors, adapters.files) == (5, 3, 6)
    assert adapters.room_circles == adapters.file_circles == []


def test_a_package_s_face_leads_to_the_package_and_a_submodule_to_itself(tmp_path: Path) -> None:
    build(
        tmp_path,
        core__policy____init__="from palpate.core.policy.table import Table\n",
        core__policy__table="",
        core__loop="from palpate.core.policy import Table, table\n",
    )
    core = house(tmp_path).roots["core"]
    assert core.arrows == {"loop": ["policy"]}
    assert core.file_circles == []


def test_an_arrow_that_only_a_string_makes_is_told_apart(tmp_path: Path) -> None:
    tables = '"""See palpate.adapters.log."""\nCOMMANDS = {"run": "palpate.adapters.runs.run:main"}\n'
    build(tmp_path, adapters__cli__main=tables, adapters__runs__run="", adapters__log="")
    adapters = house(tmp_path).roots["adapters"]
    assert (adapters.arrows, adapters.arrows_by_name) == ({}, ["cli -> runs"])


def test_circles_are_named_and_stand_on_one_floor(tmp_path: Path) -> None:
    build(
        tmp_path,
        core__a="import palpate.core.b\n",
        core__b="import palpate.core.c\n",
        core__c="import palpate.core.b\nimport palpate.core.d\n",
        core__d="",
    )
    found = house(tmp_path)
    assert found.roots["core"].room_circles == [["b", "c"]]
    assert found.roots["core"].file_circles == [["palpate.core.b", "palpate.core.c"]]
    assert found.roots["core"].floors == 3
    assert "circle of rooms in core: b, c" in text(found)


def test_rooms_may_circle_without_files_doing_so(tmp_path: Path) -> None:
    build(
        tmp_path, core__a__x="import palpate.core.b.y\n", core__b__y="", core__b__z="import palpate.core.a.w\n",
        core__a__w="",
    )  # fmt: skip
    core = house(tmp_path).roots["core"]
    assert (core.room_circles, core.file_circles) == ([["a", "b"]], [])


def test_lines_and_class_names(tmp_path: Path) -> None:
    build(
        tmp_path,
        core__a="class Spread: ...\nclass One:\n    class Inner: ...\n",
        drivers__b="class Spread: ...\nclass Inner: ...",
    )
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_a.py").write_text("x = 1\n\n")
    found = house(tmp_path)
    assert (found.source_lines, found.tests_lines) == (5, 2)
    assert found.repeated_classes == {
        "Inner": ["palpate.core.a", "palpate.drivers.b"],
        "Spread": ["palpate.core.a", "palpate.drivers.b"],
    }
    assert json.loads(json.dumps(found.as_dict()))["roots"]["core"]["arrow_count"] == 0


def test_a_folder_without_sources_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no palpate sources"):
        house(tmp_path)
