"""The entry point of the benchmarks, with benchmarks that take no time."""

import json
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.suite import __main__ as suite
from benchmarks.suite.processes import peak_MB
from benchmarks.suite.rows import QUICK, Benchmark, Form, MissingError, Row, Suite
from benchmarks.suite.text import BEGIN, END, rewrite, section, table


def quick_rows(form: Form) -> list[Row]:
    return [Row("a run", 12.0, "us a tick", "bare physics", 10.0), Row("a | b", 0.5, "MB")]


def nothing_there(form: Form) -> list[Row]:
    raise MissingError("aalpy is not installed")


def broken(form: Form) -> list[Row]:
    raise SystemExit("the two runs differ")


ONES = (
    Benchmark("one", "Runs", quick_rows, "Wall time."),
    Benchmark("two", "Peers", nothing_there),
    Benchmark("three", "Broken", broken),
)


@pytest.fixture
def measured() -> Suite:
    return suite.measure(ONES, QUICK)


def test_what_is_missing_or_breaks_does_not_keep_others_from_being_measured(measured: Suite) -> None:
    runs, peers, broken_one = measured.groups
    assert len(runs.rows) == 2
    assert (peers.missing, peers.failed) == ("aalpy is not installed", False)
    assert (broken_one.missing, broken_one.failed) == ("SystemExit: the two runs differ", True)
    assert measured.form == "quick"


def test_figures_survive_json_to_the_bit(measured: Suite) -> None:
    told = json.loads(json.dumps(measured.as_dict()))
    assert told["groups"][0]["rows"][0]["ratio"] == pytest.approx(1.2)
    assert Suite.of(told) == measured
    with pytest.raises(ValueError, match="schema"):
        Suite.of({**told, "schema": "other/1"})


def test_the_table_has_a_line_for_every_figure_and_every_gap(measured: Suite) -> None:
    lines = table(measured).splitlines()
    (run,) = [line for line in lines if line.startswith("  a run")]
    assert re.split("  +", run.strip()) == ["a run", "12.0 us a tick", "bare physics: 10.0", "1.20"]
    assert sum(line == "  not measured: aalpy is not installed" for line in lines) == 1


def test_the_section_is_rewritten_and_all_else_stays(tmp_path: Path, measured: Suite) -> None:
    document = tmp_path / "results.md"
    document.write_text(f"# Results\n\nbefore\n\n{BEGIN}\nold\n{END}\n\nafter, without a newline", encoding="utf-8")
    rewrite(document, section(measured))
    first = document.read_text(encoding="utf-8")
    assert first.startswith(f"# Results\n\nbefore\n\n{BEGIN}\n## All benchmarks, one run\n")
    assert first.endswith(f"{END}\n\nafter, without a newline")
    assert "old" not in first
    assert "| a run | 12.0 us a tick | bare physics: 10.0 | 1.20 |" in first
    assert "| a / b | 0.500 MB |  |  |" in first
    assert "Not measured: aalpy is not installed." in first
    rewrite(document, section(measured))
    assert document.read_text(encoding="utf-8") == first
    assert [path.name for path in tmp_path.iterdir()] == ["results.md"]


@pytest.mark.parametrize("text", [BEGIN, END, f"{END}\n{BEGIN}", f"{BEGIN}\n{END}\n{BEGIN}\n{END}"])
def test_broken_marks_are_refused_and_the_document_stays(tmp_path: Path, measured: Suite, text: str) -> None:
    document = tmp_path / "results.md"
    document.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="once each"):
        rewrite(document, section(measured))
    assert document.read_text(encoding="utf-8") == text


def test_the_command_measures_writes_and_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(suite, "ALL", ONES)
    figures, document = tmp_path / "made" / "bench.json", tmp_path / "results.md"
    document.write_text("mine\n")
    assert suite.main(["--quick", "--only", "one", "two", "--json", str(figures), "--write", str(document)]) == 0
    out, progress = capsys.readouterr()
    assert "quick form" in out
    assert progress.splitlines()[1] == "two ... 0 s aalpy is not installed"
    written = document.read_text()
    # From the figures alone the same section comes again.
    document.write_text("mine\n")
    assert suite.main(["--from", str(figures), "--write", str(document)]) == 0
    assert document.read_text() == written
    assert suite.main(["--quick", "--only", "three"]) == 1


def test_a_short_benchmark_of_each_kind_gives_figures_with_floors() -> None:
    short = replace(QUICK, trials=4, rounds=1, machines=20)
    for name in ("ticks", "minimise"):
        (benchmark,) = [one for one in suite.ALL if one.name == name]
        rows = benchmark.measure(short)
        assert all(row.value > 0.0 and row.ratio is not None and row.ratio > 0.0 for row in rows)


def test_memory_is_that_of_the_process_alone() -> None:
    bare, more = peak_MB("pass"), peak_MB("kept = bytearray(80_000_000)")
    assert 3.0 < bare < 60.0
    assert more - bare == pytest.approx(76.3, abs=5.0)
    with pytest.raises(subprocess.CalledProcessError):
        peak_MB("raise SystemExit(3)")
