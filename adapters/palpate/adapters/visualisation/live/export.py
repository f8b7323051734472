"""Logs as files for Rerun."""

from collections import deque
from collections.abc import Sequence
from pathlib import Path

from palpate.adapters.files import new_folder
from palpate.adapters.log import TrialLog, learner_of_json, names_for, read_log
from palpate.adapters.visualisation.live.recording import Recording, values_in
from palpate.core.policy import PolicyDocument


def export_rerun(paths: Sequence[Path], out: Path) -> list[Path]:
    """Write a ``.rrd`` file for each log into a new or empty folder; returns the files.

    Raises:
        OutputError: The folder holds something.
        LogError: A log cannot be used.
    """
    names = [f"{name}.rrd" for name in names_for(paths)]
    with new_folder(out) as passing:
        for path, name in zip(paths, names, strict=True):
            log = read_log(path)
            with Recording.file(passing / name) as view:
                _show(log, view)
    return [out / name for name in names]


def _show(log: TrialLog, view: Recording) -> None:
    start, shown = log.start, TrialLog(log.path, log.size_bytes, log.start, end=log.end)
    events, decisions = deque(log.events), deque(log.decisions)
    policy = PolicyDocument.from_json_text(start.policy_json) if start.policy_json else None
    for record in log.records():
        if record.tick == 0:
            view.begin(shown, record.time_ns or 0, values_in(policy, learner_of_json(start.learner_json)))
        view.tick(record)
        while events and events[0].tick <= record.tick:
            view.event(events.popleft())
        while decisions and decisions[0].tick <= record.tick:
            view.decision(decisions.popleft())
    view.end()
