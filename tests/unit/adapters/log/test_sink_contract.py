"""The contract of sinks, over all of them; each clause finds the sink that breaks it."""

from pathlib import Path

import pytest

from palpate.adapters.log import EndRecord, FileSink, TickRecord, read_log
from palpate.adapters.replay.trial import ReplayedRecords
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.test_sink import messages

KEPT = list(range(1, 36))
"""The ticks of a small log."""


class SinkContract:
    """What a recorder expects of any sink; a subclass makes one, and reads a log that it was given."""

    keeps_all = True
    """Whether earlier logs are kept when the next one begins, and none is written over."""

    @pytest.fixture(autouse=True)
    def _sink(self, tmp_path):
        self.folder = tmp_path
        self.sink = self.make()
        yield
        self.sink.shut()

    def write(self, name, trial=None, *, close=True):
        """Write a log; returns what was lost meanwhile."""
        before = len(self.sink.losses)
        self.sink.open(self.folder / name, {})
        for message in trial or messages(36):
            self.sink.put(message)
        if close:
            self.sink.close()
        return self.sink.losses[before:]

    def test_sound_log_has_its_own_messages_and_no_loss(self):
        for name in ("a", "b"):
            assert self.write(name) == []
            assert self.kept(name) == KEPT

    def test_log_left_open_ends_with_the_next_one(self):
        self.write("a", close=False)
        self.write("b")
        assert self.kept("b") == KEPT
        assert not self.keeps_all or self.kept("a") == KEPT

    def test_message_that_cannot_be_packed_costs_no_other(self):
        trial = messages(36)
        trial[6] = trial[6]._replace(record=EndRecord(tick=2**64))
        lost = self.write("a", trial)
        assert self.kept("a") == [tick for tick in KEPT if tick != 6]
        assert len(lost) == self.keeps_all

    def test_existing_log_stays_and_the_next_one_is_kept(self):
        if not self.keeps_all:
            pytest.skip("this sink has one log at a time")
        self.write("a")
        assert len(self.write("a", messages(3))) == 1
        assert self.kept("a") == KEPT
        self.write("b")
        assert self.kept("b") == KEPT


class TestFiles(SinkContract):
    def make(self):
        return FileSink()

    def kept(self, name):
        # The end of a log that was left open is written by the time that the sink is shut.
        self.sink.shut()
        return [record.tick for record in read_log(self.folder / name).records()]


class TestMemory(SinkContract):
    def make(self):
        return MemorySink()

    def kept(self, name):
        path = self.folder / f"{name}.mcap"
        path.write_bytes(self.sink.streams[self.folder / name].getvalue())
        return [record.tick for record in read_log(path).records()]


class TestReplayed(SinkContract):
    keeps_all = False

    def make(self):
        return ReplayedRecords()

    def kept(self, name):
        return [record.tick for record in self.sink.of[TickRecord]]


class Complaining(MemorySink):
    def open(self, path, metadata):
        if self.streams and path not in self.streams:
            self.losses.append("something")
        super().open(path, metadata)


class Deaf(MemorySink):
    """Begins no log before the last one was closed."""

    def open(self, path, metadata):
        if self._log is None:
            super().open(path, metadata)


class Fragile(MemorySink):
    """Keeps nothing of a log after a message that cannot be packed."""

    def put(self, message):
        super().put(message)
        if isinstance(message.record, EndRecord):
            self.close()


class Overwriting(MemorySink):
    def open(self, path, metadata):
        self.streams.pop(path, None)
        super().open(path, metadata)


BROKEN = {
    Complaining: "sound_log_has_its_own_messages_and_no_loss",
    Deaf: "log_left_open_ends_with_the_next_one",
    Fragile: "message_that_cannot_be_packed_costs_no_other",
    Overwriting: "existing_log_stays_and_the_next_one_is_kept",
}


@pytest.mark.parametrize(("kind", "clause"), BROKEN.items())
def test_without_any_one_clause_a_broken_sink_passes(kind, clause, tmp_path):
    clauses, failed = {name for name in dir(SinkContract) if name.startswith("test_")}, set()
    assert clauses == {f"test_{each}" for each in BROKEN.values()}
    for name in clauses:
        suite = TestMemory()
        suite.folder, suite.sink = Path(tmp_path, name), kind()
        suite.folder.mkdir()
        try:
            getattr(suite, name)()
        except (AssertionError, KeyError):
            failed.add(name)
    assert failed == {f"test_{clause}"}
