"""``palpate log`` on the logs of a training run, and on files that are no logs."""

import json
from pathlib import Path

import pytest

from palpate.adapters.log.reader import read_log


@pytest.fixture(scope="module")
def logs(trained):
    """The logs of a finished run of three trials; to be read, not changed."""
    found = sorted((trained / "logs").glob("*.mcap"))
    assert len(found) == 3
    return found


@pytest.fixture
def desk(tmp_path, logs):
    """A sound log, and all kinds of files that are none."""
    sound = logs[0].read_bytes()
    middle = len(sound) // 2
    contents = {
        "sound.mcap": sound,
        "torn.mcap": sound[:middle],
        "damaged.mcap": sound[:middle] + bytes([sound[middle] ^ 0xFF]) + sound[middle + 1 :],
        "empty.mcap": b"",
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def test_folder_stands_for_the_logs_in_it(palpate, logs):
    assert palpate.succeed("log", "info", logs[0].parents[1]) == palpate.succeed("log", "info", *logs)
    assert "3 trials as CSV" in palpate.succeed("log", "export", logs[0].parent, "--to", "csv", "--out", "csv")
    Path("none").mkdir()
    assert "none: holds no logs" in palpate.refusal("log", "info", "none")


def test_info_of_several_logs_is_a_table_and_json_holds_all(palpate, logs):
    lines = palpate.succeed("log", "info", *logs).splitlines()
    assert len(lines) == 4
    assert lines[0].split()[:2] == ["log", "trial"]
    assert [line.split()[1] for line in lines[1:]] == ["0", "1", "2"]
    message = json.loads(palpate.succeed("log", "info", "--json", *logs))
    assert [info["trial"] for info in message] == [0, 1, 2]
    for info, path in zip(message, logs, strict=True):
        assert info["messages"]["/tick"] == info["ticks"]["count"] == len(read_log(path).ticks)
        assert info["ticks"]["rate_Hz"] == pytest.approx(140.0, abs=1e-3)
        assert info["size_bytes"] == path.stat().st_size
        assert (info["ticks"]["missing"], info["dropped_messages"]) == (0, 0)


def test_bad_log_does_not_hide_the_others(palpate, desk):
    done = palpate("log", "info", "sound.mcap", "torn.mcap", "damaged.mcap", "empty.mcap")
    assert done.code == 2
    assert done.stderr == "palpate: empty.mcap: is empty; nothing was recorded; delete it\n"
    rows = [line.split() for line in done.stdout.splitlines()]
    assert [row[0] for row in rows] == ["log", "sound.mcap", "torn.mcap", "damaged.mcap"]
    assert ["damaged" in row for row in rows[1:]] == [False, True, True]


def test_plot_beside_the_log_or_where_asked(palpate, desk):
    assert "sound.png" in palpate.succeed("log", "plot", "sound.mcap")
    palpate.succeed("log", "plot", "sound.mcap", "--out", "other.png")
    beside, other = (desk / "sound.png").read_bytes(), (desk / "other.png").read_bytes()
    assert beside.startswith(b"\x89PNG")
    assert beside == other
    assert "sound.png" in palpate.refusal("log", "plot", "sound.mcap")
    assert (desk / "sound.png").read_bytes() == beside


def test_torn_and_a_damaged_log_are_used_up_to_the_damage(palpate, desk):
    for name in ("torn", "damaged"):
        log = read_log(desk / f"{name}.mcap")
        page = palpate("log", "info", f"{name}.mcap")
        assert page.code == 2
        assert "DAMAGED        offset " in page.stdout
        drawn = palpate("log", "plot", f"{name}.mcap")
        assert (drawn.code, drawn.stderr) == (0, f"palpate: {name}.mcap: {log.damage}\n")
    done = palpate("log", "export", "torn.mcap", "--to", "csv", "--out", "csv")
    assert (done.code, done.stderr) == (0, f"palpate: torn.mcap: {read_log('torn.mcap').damage}\n")
