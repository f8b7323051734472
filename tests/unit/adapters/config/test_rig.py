"""A rig file that says by a URDF what its arm is."""

from pathlib import Path

import pytest

from palpate.adapters.config import RigFile
from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription

RIG = '[force_sensor]\nadapter = "jr3-can"\n[arm]\nadapter = "cia402"\nbitrate = 500000\n'
ARM = 'urdf = "arms/bench.urdf"\nflange = "tool"\nposture_rad = [0, 1, 0, 1, 0, 1, 0]\n'


def test_the_arm_of_a_rig_is_parted_from_what_its_adapter_is_told(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG + ARM)
    rig = RigFile.load(path)
    assert rig.arm.settings == {"bitrate": 500000}
    assert isinstance(rig.model, ArmDescription)
    assert (rig.model.name, rig.model.urdf) == ("bench", str(tmp_path / "arms/bench.urdf"))
    assert len(rig.model.encoder_step_rad) == 7
    path.write_text(RIG)
    assert not RigFile.load(path).model
    with pytest.raises(ConfigurationError, match=r"in the rig file \[arm\] name = "):
        RigFile.load(path).arm_model()
    assert RigFile.load(path).arm_model("ur5e") == "ur5e"
    path.write_text(RIG + 'name = "ur5e"\n')
    assert RigFile.load(path).model == RigFile.load(path).arm_model("ur5e") == "ur5e"
    with pytest.raises(ConfigurationError, match="arm = 'ur10e' is refused: ur5e, which the rig file has"):
        RigFile.load(path).arm_model("ur10e")
    path.write_text(RIG + 'name = "ur5e"\ncalibration = "own.yaml"\n')
    calibrated = RigFile.load(path).model
    assert isinstance(calibrated, ArmDescription)
    assert (calibrated.name, calibrated.calibration) == ("ur5e", str(tmp_path / "own.yaml"))
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
