"""A sound log of what is left of a torn or damaged one."""

from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import Writer

from palpate.adapters.log import EndRecord, EventEntry, TrialLog, read_log
from palpate.adapters.log.container import outer_records
from palpate.adapters.log.recover import RECOVERED, Recovery, recover
from palpate.core.errors import LogError
from tests.unit.adapters.log.made_logs import PERIOD_NS, start, tick, write_log

TICKS = 120


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    """Four chunks of ticks, with events among them."""
    events = [EventEntry(tick=k, name="phase", detail="explore") for k in (3, 50, 90)]
    end = EndRecord(tick=TICKS - 1, outcome="inserted", ticks=TICKS)
    return write_log(tmp_path / "trial.mcap", [tick(k) for k in range(TICKS)], others=events, end=end)


def recovered(path: Path, data: bytes) -> tuple[Recovery, TrialLog]:
    """What is recovered from these bytes, which are put where the log was."""
    path.write_bytes(data)
    out = path.with_name("out.mcap")
    out.unlink(missing_ok=True)
    made = recover(path, out)
    assert made is not None
    return made, read_log(out)


def test_a_sound_log_is_left_alone(sound: Path) -> None:
    before = sorted(sound.parent.iterdir())
    assert recover(sound, sound.with_name("out.mcap")) is None
    assert sorted(sound.parent.iterdir()) == before


def test_a_torn_log_keeps_its_whole_chunks(sound: Path) -> None:
    data, whole = sound.read_bytes(), read_log(sound)
    made, log = recovered(sound, data[: len(data) * 6 // 10])
    assert 0 < len(log.ticks) < TICKS
    assert log.ticks == whole.ticks[: len(log.ticks)]
    assert log.start == whole.start
    assert log.events == [event for event in whole.events if event.tick < len(log.ticks)]
    assert log.end is None
    (mark,) = log.losses
    assert (mark.problem, mark.tick) == (RECOVERED, len(log.ticks) - 1)
    assert "offset" in mark.text
    assert "the file ends within a record" in mark.text
    assert (made.ticks, made.ended) == (len(log.ticks), False)
    assert made.seconds == pytest.approx((len(log.ticks) - 1) * PERIOD_NS * 1e-9)
    assert 0 < made.lost_bytes < made.size_bytes == len(data) * 6 // 10


def test_times_stay_and_other_tools_read_it(sound: Path) -> None:
    data = sound.read_bytes()
    recovered(sound, data[: len(data) * 6 // 10])
    with sound.with_name("out.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [(channel.topic, message.log_time) for _, channel, message in reader.iter_messages()]
        (metadata,) = [record.metadata for record in reader.iter_metadata()]
    times = [time for topic, time in found if topic == "/tick"]
    assert times == [k * PERIOD_NS for k in range(len(times))]
    assert found[-1] == ("/recorder", times[-1])
    assert metadata["recovered_from"] == "trial.mcap"
    assert (metadata["arm"], metadata["trial"]) == ("zebra-zero", "3")


def test_wherever_it_is_torn_what_is_kept_is_the_beginning(sound: Path) -> None:
    data, whole = sound.read_bytes(), read_log(sound)
    kept = []
    for cut in range(0, len(data), 211):
        try:
            _, log = recovered(sound, data[:cut])
        except LogError:
            assert not sound.with_name("out.mcap").exists()
            kept.append(-1)
            continue
        assert log.ticks == whole.ticks[: len(log.ticks)]
        kept.append(len(log.ticks))
    # More of the file never means less of the trial, and in the end all of it.
    assert kept == sorted(kept)
    assert (kept[0], kept[-1]) == (-1, TICKS)
    assert len(set(kept)) > 4


def test_wherever_a_byte_is_wrong_what_is_kept_is_true(sound: Path) -> None:
    data, whole = sound.read_bytes(), read_log(sound)
    kept = set()
    for place in range(0, len(data), 173):
        wrong = bytearray(data)
        wrong[place] ^= 0x41
        try:
            _, log = recovered(sound, bytes(wrong))
        except LogError:
            continue
        assert log.ticks == whole.ticks[: len(log.ticks)]
        kept.add(len(log.ticks))
    assert len(kept) > 3
    assert TICKS in kept


@pytest.mark.parametrize("kind", range(16))
def test_a_chunk_that_looks_like_something_else_ends_what_is_kept(sound: Path, kind: int) -> None:
    data, whole = bytearray(sound.read_bytes()), read_log(sound)
    chunks = [at for opcode, at, _ in outer_records("", bytes(data), 8) if opcode == Opcode.CHUNK]
    assert len(chunks) > 3
    if kind == Opcode.CHUNK:
        kind = 0x86
    data[chunks[2]] = kind
    _, log = recovered(sound, bytes(data))
    # Without its kind a chunk is passed over by any reader, and the ticks in it would be missing unnoticed.
    assert 0 < len(log.ticks) < TICKS
    assert log.ticks == whole.ticks[: len(log.ticks)]


def test_what_follows_the_end_is_cut_off(sound: Path) -> None:
    whole = read_log(sound)
    data = sound.read_bytes()
    for more in (b"rubbish", data):
        made, log = recovered(sound, data + more)
        assert log.ticks == whole.ticks
        assert log.end == whole.end
        assert made.ended


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "is empty"),
        (b"tick,time\n1,2\n", "is no MCAP file"),
        (b"\x89MCAP0\r\n", "nothing can be kept"),
        (b"\x89MCAP0\r\n" + b"\x06" + b"\xff" * 60, "nothing can be kept"),
    ],
)
def test_files_of_which_nothing_can_be_kept(tmp_path: Path, content: bytes, complaint: str) -> None:
    path, out = tmp_path / "a.mcap", tmp_path / "b.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match=complaint):
        recover(path, out)
    assert list(tmp_path.iterdir()) == [path]


def test_another_programs_sound_file_is_none_of_ours(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "elsewhere")
        schema = writer.register_schema("S", "jsonschema", b"{}")
        channel = writer.register_channel("/scan", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    with pytest.raises(LogError, match="no messages of palpate's"):
        recover(path, tmp_path / "b.mcap")


def test_a_log_without_its_start_cannot_be_kept(sound: Path) -> None:
    data = bytearray(sound.read_bytes())
    first = next(at for opcode, at, _ in outer_records("", bytes(data), 8) if opcode == Opcode.CHUNK)
    data[first + 200] ^= 0x41
    sound.write_bytes(data)
    with pytest.raises(LogError, match="nothing can be kept"):
        recover(sound, sound.with_name("out.mcap"))
    assert list(sound.parent.iterdir()) == [sound]


def test_another_schema_is_not_touched(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", [tick(0)], begin=start(schema="palpate.log/9"))
    with pytest.raises(LogError, match=r"palpate\.log/9"):
        recover(path, tmp_path / "b.mcap")
