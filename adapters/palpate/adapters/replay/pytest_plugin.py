"""``pytest --palpate-logs DIR``: every log in DIR is a test that passes if the trial replays bit for bit.

A laboratory can test its repository on its own trials. The module imports little, because pytest always loads it.
"""

from pathlib import Path
from typing import Any, Final

import pytest

_REBUILDER: Final = pytest.StashKey[Any]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add palpate's options."""
    group = parser.getgroup("palpate", "recorded trials as tests (palpate)")
    group.addoption(
        "--palpate-logs",
        action="append",
        default=[],
        metavar="DIR",
        help="replay every palpate log in DIR (or a log, or a pattern); may be given several times",
    )
    group.addoption(
        "--palpate-strict",
        action="store_true",
        help="let logs from another processor fail when their last bits differ",
    )


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(session: pytest.Session, config: pytest.Config, items: list[pytest.Item]) -> None:
    """Add one test for each log, before other plugins select tests."""
    names = config.getoption("palpate_logs")
    if not names:
        return
    from palpate.adapters.log import find_logs
    from palpate.core.errors import LogError

    try:
        paths = find_logs(names)
    except LogError as error:
        raise pytest.UsageError(f"--palpate-logs: {error}") from error
    items += [LogItem.from_parent(session, name=str(path), log=path) for path in paths]


class ReplayDiffersError(Exception):
    """A recorded trial does not replay identically. The message contains the full explanation."""


class LogItem(pytest.Item):
    """A recorded trial, used as a test."""

    def __init__(self, *, log: Path, **others: Any) -> None:
        super().__init__(**others)
        self._log = log

    def runtest(self) -> None:
        """Replay the trial."""
        from palpate.adapters.replay.batch import exit_code, explanation, replay_file
        from palpate.adapters.replay.rebuild import Changes, Rebuilder

        rebuilder = self.session.stash.setdefault(_REBUILDER, Rebuilder())
        strict = bool(self.config.getoption("palpate_strict"))
        one = replay_file(self._log, rebuilder)
        if exit_code([one], strict=strict):
            raise ReplayDiffersError(explanation(one, Changes(), strict=strict).strip())

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *_: Any) -> Any:
        """Return one line for a trial that differs, and the traceback for any other error."""
        if isinstance(excinfo.value, ReplayDiffersError):
            return str(excinfo.value)
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return the location of the test."""
        return self._log, None, f"replay of {self._log}"
