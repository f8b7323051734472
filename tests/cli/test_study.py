"""``palpate study``: conditions like runs of their own, interrupted, failed, continued."""

import signal

from palpate.simulation.work_cell.cell import WorkCell
from tests.command_line import RESULTS, STUDY, CommandLine, files_in, results_in


def run(text, out, *words):
    """Run a study in this process."""
    file = out.parent / f"{out.name}.toml"
    file.write_text(text)
    return CommandLine()("study", file, "--out", out, *words)


def make(text, out):
    """Run a study in this process and on it, which must go well."""
    done = run(text, out, "--jobs", 1)
    assert done.code == 0, done
    return done


def finished_in(out):
    folder = out / "conditions"
    return sorted(path.name for path in folder.glob("[!.]*")) if folder.exists() else []


def begun_in(out):
    return sorted((out / "conditions").glob(".*.part/trials.csv"))


def times_in(out):
    return {str(path.relative_to(out)): path.stat().st_mtime_ns for path in (out / "conditions").rglob("*")}


def test_a_condition_is_what_train_or_run_leaves(palpate, studied, tmp_path):
    flags = ("--task.time-limit-s", 0.3, "--trials", 2, "--seed", 1, "--recording.no-enabled")
    folder = studied / "conditions" / "q-learning,seed=1"
    palpate.succeed("train", *flags, "--out", "trained")
    assert results_in(folder) == results_in(tmp_path / "trained")
    assert (folder / "run.toml").read_bytes() == (tmp_path / "trained" / "run.toml").read_bytes()
    assert {path.name for path in folder.iterdir()} == {*RESULTS, "run.toml"}
    palpate.succeed("run", "--policy", "torque", *flags, "--out", "run")
    assert files_in(studied / "conditions" / "torque,seed=1") == files_in(tmp_path / "run")


def test_finished_conditions_are_not_run_again(palpate, studied, tmp_path):
    out = tmp_path / "out"
    make(STUDY.replace("[0, 1]", "[1]"), out)
    before = times_in(out)
    assert "4 conditions of 2 trials in " in (printed := make(STUDY, out).stdout)
    assert "finished: 2" in printed
    assert before.items() <= times_in(out).items()
    assert files_in(out) == files_in(studied)
    # Nor with the study that the folder holds.
    before = times_in(out)
    palpate.succeed("study", out / "study.toml", "--out", out, "--jobs", 1)
    assert times_in(out) == before
    assert files_in(out) == files_in(studied)


def test_a_condition_that_fails_is_named_and_the_others_are_run(tmp_path, monkeypatch):
    monkeypatch.setattr("palpate.adapters.experiments.study.Condition.require_possible", lambda condition: None)
    out = tmp_path / "out"
    text = STUDY.replace("[0, 1]", "[0]") + "[grid]\ntask.goal.x_mm = [400.0, 1900.0]\n"
    done = run(text, out, "--jobs", 1)
    assert done.code == 1
    assert "finished: 2 of 4 conditions" in done.stdout
    assert "2 conditions failed" in done.stdout
    assert done.stderr.count("failed: place must be ") == 2
    assert finished_in(out) == ["q-learning,x_mm=400.0,seed=0", "torque,x_mm=400.0,seed=0"]
    assert len((out / "summary.csv").read_text().splitlines()) == 3


def test_a_full_disk_ends_the_study_in_one_line_and_what_is_finished_stays(tmp_path, monkeypatch):
    out, advance = tmp_path / "out", WorkCell.advance

    def fail(cell):
        if finished_in(out):
            raise OSError(28, "No space left on device")
        advance(cell)

    monkeypatch.setattr(WorkCell, "advance", fail)
    done = run(STUDY, out, "--jobs", 1)
    assert done.code == 2
    assert done.stderr.count("palpate: ") == 1
    assert "cannot be written (No space left on device); make room and run the same command again" in done.stderr
    assert len(finished_in(out)) == 1
    assert len((out / "summary.csv").read_text().splitlines()) == 2


def require_ended_in_order(done, out):
    assert done.code == 130
    finished = finished_in(out)
    assert f"{len(finished)} of " in done.stdout
    assert f"continue with: palpate study {out}.toml --out {out}" in done.stdout
    assert {path.name for path in (out / "conditions").iterdir()} == set(finished)
    assert len((out / "summary.csv").read_text().splitlines()) == 1 + len(finished)


def test_ctrl_c_in_a_condition_keeps_what_is_finished(tmp_path, monkeypatch):
    out, advance = tmp_path / "out", WorkCell.advance

    def interrupted(cell):
        if len(finished_in(out)) == 1 and begun_in(out):
            signal.raise_signal(signal.SIGINT)
        advance(cell)

    monkeypatch.setattr(WorkCell, "advance", interrupted)
    require_ended_in_order(run(STUDY, out, "--jobs", 1), out)
    assert len(finished_in(out)) == 1
