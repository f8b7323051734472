"""A fault of a rig outlives the program; a person clears that one only, once."""

import json
from pathlib import Path

import pytest

from palpate.adapters.hardware.fault_file import FaultFile
from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError, OutputError
from palpate.core.ports import Acknowledgement


@pytest.fixture
def rig(tmp_path):
    return tmp_path / "rig.toml"


def faults(rig):
    return json.loads(Path(f"{rig}.fault.json").read_text())["faults"]


def tripped(rig, cause="FORCE_LIMIT: force 31.00 N, limit 30 N"):
    latch = FaultFile(rig)
    latch.begin()
    latch.set(cause)
    latch.set("a later cause")
    latch.end()


def test_new_rig_has_no_fault_and_a_file_before_it_moves(rig):
    FaultFile(rig).begin()
    assert faults(rig) == []


def test_fault_outlives_its_program_and_names_the_option_to_copy(rig, capsys):
    tripped(rig)
    option = '--acknowledge "1 NAME: why"'
    message = capsys.readouterr().err
    assert message.startswith("palpate: fault 1: FORCE_LIMIT: force 31.00 N, limit 30 N; kept in ")
    assert message.endswith(f"acknowledge it: {option}\n")
    with pytest.raises(FaultLatchedError) as refused:
        FaultFile(rig)
    assert "FORCE_LIMIT: force 31.00 N, limit 30 N" in str(refused.value)
    assert str(refused.value).endswith(option)


def test_acknowledgement_clears_that_fault_only_and_once(rig):
    tripped(rig)
    for words in ("2 Ada: fixed", "0 Ada: fixed"):
        with pytest.raises(ConfigurationError, match="the open fault, 1 "):
            FaultFile(rig, words)
    words = "1 Ada Lovelace: the plate: moved back"
    latch = FaultFile(rig, words)
    latch.begin()
    assert latch.acknowledgements == [
        Acknowledgement("Ada Lovelace", "the plate: moved back", "FORCE_LIMIT: force 31.00 N, limit 30 N")
    ]
    latch.require_free()
    with pytest.raises(ConfigurationError, match="left out: no fault is open; Ada Lovelace acknowledged fault 1 at "):
        FaultFile(rig, words)
    tripped(rig, "PULLED: again")
    with pytest.raises(ConfigurationError, match="the open fault, 2 "):
        FaultFile(rig, words)
    (first, second) = faults(rig)
    assert (first["by"], first["reason"]) == ("Ada Lovelace", "the plate: moved back")
    assert (second["number"], second["by"]) == (2, "")


def test_acknowledgement_counts_only_once_the_rig_is_open(rig):
    tripped(rig)
    latch = FaultFile(rig, "1 Ada: fixed")
    assert faults(rig)[0]["by"] == ""
    latch.still = lambda: "arm: protective stop"
    with pytest.raises(DeviceError, match="arm: protective stop, still; fault 1 cannot be acknowledged"):
        latch.begin()
    assert faults(rig)[0]["by"] == ""
    with pytest.raises(FaultLatchedError):
        FaultFile(rig)


@pytest.mark.parametrize("words", ["1", "Ada: fixed", "1 Ada", "1 Ada:", "1 : mended", "1 NAME: why", "1 Ada: why"])
def test_words_without_a_number_a_name_or_a_reason_are_refused(rig, words):
    tripped(rig)
    with pytest.raises(ConfigurationError, match='"1 NAME: why", with your name and the reason'):
        FaultFile(rig, words)


@pytest.mark.parametrize("content", ["", "{", "[]", '{"format": 2, "faults": []}', '{"format": 1, "faults": [{}]}'])
def test_file_that_cannot_be_read_keeps_the_rig_still_and_is_left_alone(rig, content):
    path = Path(f"{rig}.fault.json")
    path.write_text(content)
    with pytest.raises(OutputError, match=r"fault\.json: cannot be read .*does not move"):
        FaultFile(rig, "1 Ada: fixed")
    assert path.read_text() == content


def test_file_that_cannot_be_written_keeps_the_rig_still(rig, monkeypatch, capsys):
    tripped(rig)
    before = Path(f"{rig}.fault.json").read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device", "rig.toml.fault.json")

    monkeypatch.setattr("palpate.adapters.hardware.fault_file.write_whole", full)
    latch = FaultFile(rig, "1 Ada: fixed")
    with pytest.raises(OSError, match="No space left on device"):
        latch.begin()
    with pytest.raises(FaultLatchedError):
        latch.require_free()
    assert latch.acknowledgements == []
    assert Path(f"{rig}.fault.json").read_bytes() == before
    fresh = FaultFile(rig.with_name("other.toml"))
    with pytest.raises(OSError, match="No space left on device"):
        fresh.begin()
    fresh.set("PULLED: by the plate")
    fresh.end()
    assert "not kept: No space left" in capsys.readouterr().err.splitlines()[-1]


def test_fault_that_another_program_met_meanwhile_counts(rig):
    latch = FaultFile(rig)
    tripped(rig)
    with pytest.raises(FaultLatchedError, match="FORCE_LIMIT"):
        latch.begin()
