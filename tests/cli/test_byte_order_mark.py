"""Text that begins with a byte-order mark, as editors on Windows write it, is read as the same text without it."""

import codecs
from pathlib import Path

import pytest

from palpate.adapters.config import read_toml
from palpate.adapters.experiments.grid import grid_named
from palpate.adapters.files import json_of_file, load_examples
from palpate.adapters.log import strings_from
from palpate.core.motion import ArmDescription
from palpate.core.motion.model import load_model
from tests.unit.core.motion.test_arms import urdf


def _joints(path):
    path.write_bytes(path.read_bytes() + Path(urdf(path.with_suffix(".plain"), 6)).read_bytes())
    return list(load_model(ArmDescription(str(path), "tool", (0.0,) * 6))[0].names)


@pytest.mark.parametrize(
    ("name", "text", "read"),
    [
        ("strings.txt", "AB\nBA\n", lambda path: strings_from([str(path)])),
        ("map.txt", ".A\nBA\n", lambda path: grid_named(str(path), 2)),
        ("rig.toml", '[arm]\nadapter = "zebra-zero"\n', read_toml),
        ("policy.json", '{"schema": "palpate.policy/3"}', json_of_file),
        ("examples.csv", "state,action\na,+x\n", load_examples),
        ("arm.urdf", "", _joints),
    ],
)
def test_a_byte_order_mark_is_not_part_of_a_text(tmp_path, name, text, read):
    found = []
    for mark in (b"", codecs.BOM_UTF8):
        path = tmp_path / f"with {len(mark)}" / name
        path.parent.mkdir()
        path.write_bytes(mark + text.encode())
        found.append(read(path))
    assert found[0] == found[1]
