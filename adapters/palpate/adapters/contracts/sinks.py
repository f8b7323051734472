"""The contract of log sinks (``palpate.adapters.log.Sink``), as a test suite that ships with the package."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from palpate.adapters.contracts.bench import require

_BATCHES: Final = 5


class SinkContract(ABC):
    """Every sink keeps these clauses; a subclass makes it, and reads what it keeps."""

    @abstractmethod
    def make(self) -> Any:
        """Return a new sink."""

    @abstractmethod
    def batch(self, number: int, *, unfit: bool = False) -> Any:
        """Return the batch of messages of that number; the first one begins a trial.

        Args:
            unfit: One of its messages cannot be packed.
        """

    @abstractmethod
    def kept(self, path: Path) -> tuple[list[int], bool]:
        """Read the numbers of the batches of the log under this name, and whether it was closed."""

    @contextmanager
    def sink(self) -> Iterator[Any]:
        """Give a sink, and shut it."""
        made = self.make()
        yield made
        made.shut()

    def record(self, sink: Any, path: Path, *, close: bool = True, unfit: bool = False) -> None:
        """Record a log."""
        sink.open(path, {"schema": "contract"})
        for number in range(_BATCHES):
            sink.put(self.batch(number, unfit=unfit and number == 1))
        if close:
            sink.close()

    def require_kept(self, clause: str, path: Path, *, closed: bool = True) -> None:
        """Require all batches of a log, in order."""
        found, wanted = self.kept(path), (list(range(_BATCHES)), closed)
        require(clause, found == wanted, f"{path.name} holds {found}", f"batches and whether it is whole: {wanted}")

    def require_troubles(self, clause: str, sink: Any, count: int) -> None:
        """Require a number of troubles."""
        require(clause, len(sink.troubles) == count, f"troubles {sink.troubles}", f"{count} troubles")

    def test_closed_log_holds_all_batches_in_order(self, tmp_path: Path) -> None:
        """A closed log can be read at once, one after the other; folders are made."""
        with self.sink() as sink:
            for name in ("a.mcap", "b.mcap"):
                self.record(sink, tmp_path / "new" / name)
                self.require_kept("closed log", tmp_path / "new" / name)
            self.require_troubles("closed log", sink, 0)

    def test_log_that_is_not_closed_holds_what_was_put(self, tmp_path: Path) -> None:
        """A log that the end of a run leaves open can be read, and shows that it is cut short."""
        with self.sink() as sink:
            self.record(sink, tmp_path / "a.mcap", close=False)
        self.require_kept("log not closed", tmp_path / "a.mcap", closed=False)

    def test_next_log_ends_one_that_is_open(self, tmp_path: Path) -> None:
        """A log that was not closed does not reach into the next one."""
        with self.sink() as sink:
            self.record(sink, tmp_path / "a.mcap", close=False)
            self.record(sink, tmp_path / "b.mcap")
        self.require_kept("next log", tmp_path / "a.mcap", closed=False)
        self.require_kept("next log", tmp_path / "b.mcap")

    def test_message_that_cannot_be_packed_is_a_trouble_and_costs_no_other(self, tmp_path: Path) -> None:
        """A recorder does not end what it records."""
        with self.sink() as sink:
            troubles = sink.troubles
            self.record(sink, tmp_path / "a.mcap", unfit=True)
            self.require_troubles("unfit message", sink, 1)
            require("unfit message", sink.troubles is troubles, "another list of troubles", "one list that grows")
        self.require_kept("unfit message", tmp_path / "a.mcap")

    def test_existing_log_stays_as_it_is_and_the_next_one_is_recorded(self, tmp_path: Path) -> None:
        """Nothing is ever overwritten."""
        with self.sink() as sink:
            self.record(sink, tmp_path / "a.mcap")
            sink.open(tmp_path / "a.mcap", {})
            sink.put(self.batch(0))
            sink.close()
            self.require_kept("existing log", tmp_path / "a.mcap")
            self.require_troubles("existing log", sink, 1)
            self.record(sink, tmp_path / "b.mcap")
            self.require_kept("existing log", tmp_path / "b.mcap")

    def test_shut_can_be_repeated(self, tmp_path: Path) -> None:
        """Whoever cleans up need not know whether it has been done."""
        with self.sink() as sink:
            self.record(sink, tmp_path / "a.mcap")
            sink.shut()
        self.require_kept("shut twice", tmp_path / "a.mcap")
