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
