"""A rig file that says by a URDF what its arm is."""

from pathlib import Path

import pytest

from palpate.adapters.config import RigFile
from palpate.core.errors import ConfigurationError

RIG = '[force_sensor]\nadapter = "jr3-can"\n[arm]\nadapter = "cia402"\nbitrate = 500000\n'
ARM = 'urdf = "arms/bench.urdf"\nflange = "tool"\nposture_rad = [0, 1, 0, 1, 0, 1, 0]\n'


def test_the_arm_of_a_rig_is_parted_from_what_its_adapter_is_told(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG + ARM)
    rig = RigFile.load(path)
    assert rig.arm.settings == {"bitrate": 500000}
    assert rig.model is not None
    assert (rig.model.name, rig.model.urdf) == ("bench", str(tmp_path / "arms/bench.urdf"))
    assert len(rig.model.encoder_step_rad) == 7
    path.write_text(RIG)
    assert RigFile.load(path).model is None
    path.write_text(RIG + ARM.replace("flange", "flansch"))
    with pytest.raises(ConfigurationError, match="missing flange"):
        RigFile.load(path)


def test_a_rig_file_of_another_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("format = 1\n" + RIG)
    assert RigFile.load(path).arm.adapter == "cia402"
    path.write_text("format = 2\n" + RIG)
    with pytest.raises(ConfigurationError, match="format = 2 is refused: 1, which this palpate reads"):
        RigFile.load(path)


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[4] / "rigs").glob("*.toml")), ids=lambda path: path.stem
)
def test_a_shipped_rig_file_states_its_format(path: Path) -> None:
    assert "\nformat = 1\n" in path.read_text()
