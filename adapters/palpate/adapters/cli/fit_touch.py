"""``palpate fit-touch``."""

import sys
from pathlib import Path

from palpate.adapters.cli.options import FitTouchOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import render_table, run_toml
from palpate.adapters.replay import find_logs, touches_of
from palpate.adapters.visualisation.report import touch_pictures
from palpate.core.errors import UsageError
from palpate.core.ports import new_folder, require_free_folder


def fit_touch(options: FitTouchOptions) -> int:
    """Fit, report and save; returns the exit code."""
    if not options.out:
        raise UsageError("palpate fit-touch needs --out, a folder for what comes of it")
    if not options.logs:
        raise UsageError("palpate fit-touch needs logs, folders with logs, or patterns in quotes")
    require_free_folder(Path(options.out))
    paths = find_logs(options.logs)
    with progress(len(paths), "log", passing=True) as bar:
        found = touches_of(paths, lambda: bar.update())
    belief = found.document.belief
    with new_folder(Path(options.out)) as folder:
        found.document.save(folder / "policy.json")
        facts = {"logs": list(options.logs)}
        (folder / "run.toml").write_text(run_toml(found.config, "fit-touch", **facts), encoding="utf-8")
        for picture in () if belief is None else touch_pictures("touch", belief, options.out):
            (folder / "touch.png").write_bytes(picture.png)
    for line in found.left_out:
        sys.stderr.write(f"left out: {line}\n")
    sys.stdout.write(f"{found.inserted} of {len(paths)} trials ended in the hole\n{render_table(found.document)}")
    sys.stdout.write(f"saved in {options.out}\n")
    return 0
