"""New files and folders come whole or not at all."""

import os
import stat
from pathlib import Path

import pytest

from palpate.adapters.files import (
    new_file,
    new_folder,
    read_text,
    require_free_folder,
    whole_text,
    write_whole,
)
from palpate.core.errors import ConfigurationError, LogError, OutputError


def test_a_file_without_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.adapters.files.whole._MOST_BYTES", 5 << 20)
    with pytest.raises(OSError, match="more than 5 MiB"):
        whole_text("/dev/zero")
    with pytest.raises(ConfigurationError, match=r"map = '/dev/zero' is refused: .*\(more than 5 MiB\)"):
        read_text(Path("/dev/zero"), "map")


def test_what_has_an_end_is_read_whole(tmp_path: Path) -> None:
    end, begin = os.pipe()
    os.write(begin, b"a\r\nb")
    os.close(begin)
    assert whole_text(f"/dev/fd/{end}").read() == "a\nb"
    os.close(end)
    assert whole_text("/dev/null").read() == ""


@pytest.mark.parametrize("durable", [True, False])
def test_a_file_is_replaced_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, durable: bool) -> None:
    synced: list[bool] = []
    fsync = os.fsync

    def noted(descriptor: int) -> None:
        synced.append(stat.S_ISDIR(os.fstat(descriptor).st_mode))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noted)
    path = tmp_path / "a.txt"
    write_whole(path, b"old and longer", durable=durable)
    write_whole(path, "n\u00fc\n", durable=durable)
    assert path.read_bytes() == b"n\xc3\xbc\n"
    assert list(tmp_path.iterdir()) == [path]
    # First the file's content, then, once it has its name, the folder's list of names.
    assert synced == ([False, True] * 2 if durable else [])


@pytest.mark.parametrize("fails", ["open", "fsync", "replace"])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: str, error: BaseException
) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(*_: object) -> None:
        raise error

    monkeypatch.setattr("builtins.open" if fails == "open" else f"os.{fails}", full)
    with pytest.raises((OSError, KeyboardInterrupt), match=r"No space left.*a\.txt" if error.args else None):
        write_whole(path, "new")
    monkeypatch.undo()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_complete_folder_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, synced = tmp_path / "out", list[str]()
    monkeypatch.setattr(os, "fsync", lambda fd: synced.append(os.path.basename(os.readlink(f"/proc/self/fd/{fd}"))))
    with new_folder(path) as passing:
        (passing / "deep").mkdir(parents=True)
        (passing / "deep" / "a.csv").write_text("1\n")
        (passing / "b.csv").write_text("2\n")
    assert sorted(synced[:-1]) == sorted(["a.csv", "b.csv", "deep", passing.name])
    assert synced[-1] == tmp_path.name
    assert (path / "deep" / "a.csv").read_text() == "1\n"


def test_a_file_is_there_only_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    with new_file(path) as passing:
        passing.write_bytes(b"half")
        assert not path.exists()
    assert path.read_bytes() == b"half"
    assert list(tmp_path.iterdir()) == [path]


def test_after_an_error_no_file_stays(tmp_path: Path) -> None:
    def fail() -> None:
        with new_file(tmp_path / "a.png") as passing:
            passing.write_bytes(b"half")
            raise LogError("x", "", "bad", "no")

    with pytest.raises(LogError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_what_came_in_between_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.png"

    def race() -> None:
        with new_file(path) as passing:
            passing.write_bytes(b"mine")
            path.write_bytes(b"theirs")

    with pytest.raises(OutputError, match="never overwritten"):
        race()
    assert path.read_bytes() == b"theirs"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_that_leads_nowhere_is_in_the_way(tmp_path: Path) -> None:
    link = tmp_path / "a.png"
    link.symlink_to(tmp_path / "nowhere")
    with pytest.raises(OutputError), new_file(link):
        pass
    with pytest.raises(OutputError), new_folder(link):
        pass
    assert link.is_symlink()


@pytest.mark.parametrize("there", [False, True])
def test_a_folder_takes_the_place_of_nothing_or_of_an_empty_one(tmp_path: Path, there: bool) -> None:
    path = tmp_path / "above" / "out"
    if there:
        path.mkdir(parents=True)
    with new_folder(path) as passing:
        (passing / "a.csv").write_text("1\n")
        assert not (path / "a.csv").exists()
    assert (path / "a.csv").read_text() == "1\n"
    assert list(path.parent.iterdir()) == [path]


def test_after_an_error_no_folder_stays_and_none_above_it(tmp_path: Path) -> None:
    def fail() -> None:
        with new_folder(tmp_path / "x" / "y" / "out") as passing:
            (passing / "a.csv").write_text("1\n")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_something_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    with pytest.raises(OutputError, match="holds something"), new_folder(tmp_path):
        pass
    with pytest.raises(OutputError, match="is no folder"), new_folder(tmp_path / "a"):
        pass
    with pytest.raises(NotADirectoryError, match="a/b"), new_folder(tmp_path / "a" / "b"):
        pass
    assert (tmp_path / "a").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 1


def test_whether_a_folder_can_be_made_is_known_beforehand(tmp_path: Path) -> None:
    for place in (tmp_path, tmp_path / "new", tmp_path / "above" / "new"):
        require_free_folder(place)
    for place in (tmp_path / ("x" * 300), Path("/proc/new")):
        with pytest.raises(OSError, match=place.name):
            require_free_folder(place)
    assert list(tmp_path.iterdir()) == []


def test_names_that_no_file_system_takes(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="too long"), new_folder(tmp_path / ("x" * 300)):
        pass
    with pytest.raises(OSError, match="too long"), new_file(tmp_path / ("x" * 300)) as passing:
        passing.write_bytes(b"")
    assert list(tmp_path.iterdir()) == []
