"""How flags, TOML files and presets come together, and how one line says what is wrong with them."""

import re

import pytest

from palpate.adapters.cli.arguments import flags_of, parse
from palpate.adapters.cli.options import CompareOptions, ExploreOptions, ReplayOptions, RunOptions, TrainOptions
from palpate.core.errors import ConfigurationError, UsageError


@pytest.fixture
def toml(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(
        'scenario = "blind"\nseed = 5\n[task]\nstep_mm = 0.25\n[cell]\nhole_uncertainty_mm = 2.0\n'
        '[run]\nformat = "palpate.run/2"\ncommand = "train"\n'
    )
    return str(path)


def config(*words):
    return parse(TrainOptions, "train", words).run


def test_flags_win_over_the_file(toml):
    found = config(f"--config={toml}", "--seed", "6", "--task.step-mm", "0.3")
    assert (found.seed, found.task.step_mm) == (6, 0.3)
    # Not of the flags but of the file: it still counts.
    assert found.cell.hole_uncertainty_mm == 2.0


def test_a_file_s_settings_of_another_learner_are_refused_but_not_a_record_s(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('learner = "sarsa"\n[learning]\noptimistic_prior = 3.0\n')
    with pytest.raises(ConfigurationError, match="options, which learning"):
        config("--config", str(file))
    file.write_text(file.read_text() + '[run]\nformat = "palpate.run/2"\ncommand = "train"\n')
    assert config("--config", str(file)).learner == "sarsa"


@pytest.mark.parametrize(("flag", "command"), [("--resume", "train"), ("--strict", "replay")])
def test_a_setting_of_another_command_is_told_where_it_belongs(flag, command):
    with pytest.raises(UsageError, match=f"^{flag} is not an option of palpate run, but of palpate {command}"):
        parse(RunOptions, "run", [flag])


@pytest.mark.parametrize("kind", [TrainOptions, ReplayOptions, ExploreOptions])
def test_the_flags_are_those_of_the_help(kind, capsys):
    with pytest.raises(SystemExit):
        parse(kind, "x", ["--help"])
    report = set(re.findall(r"(?<=[ |│])--[a-zA-Z][\w.-]*", capsys.readouterr().out))
    assert report - {"--help", "--task"} <= flags_of(kind)  # --task is short for --task.name


def test_a_run_toml_of_another_format_is_refused(tmp_path):
    path = tmp_path / "run.toml"
    for report, found in (('format = "palpate.run/0"\n', "'palpate.run/0'"), ("", "None")):
        path.write_text(f'seed = 3\n[run]\n{report}command = "train"\n')
        with pytest.raises(ConfigurationError, match=rf"run.format must be 'palpate.run/2', .* \(got {found}\)"):
            config("--config", str(path))


def test_a_run_toml_repeats_trials_and_policy_of_the_same_command(tmp_path):
    path = tmp_path / "run.toml"
    path.write_text('[run]\nformat = "palpate.run/2"\ncommand = "compare"\ntrials = 7\npolicy = ["a", "b"]\n')
    again = parse(CompareOptions, "compare", ["--config", str(path)])
    assert (again.trials, again.policy) == (7, ("a", "b"))
    assert parse(RunOptions, "run", ["--config", str(path)]).trials == RunOptions().trials


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--trails", "3"], "--trails is not an option of palpate train; did you mean --trials?"),
        (["--task.step_m", "3"], "did you mean --task.step-mm?"),
        (["--seed", "many"], "--seed"),
        (["--task.step-mm", "wide"], "task.step_mm must be a number from 0.01 to 5"),
        (["--task.step-mm"], "--task.step-mm needs a value"),
        (["--learning.programmed", "x+"], "--learning.programmed needs pairs of a name and a value (got x+)"),
    ],
)
def test_words_that_make_no_sense_are_named_in_one_line(words, message):
    with pytest.raises((UsageError, ConfigurationError)) as caught:
        parse(TrainOptions, "train", words)
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    # Nothing is left of the box that the parser draws.
    assert not set("│╭╮╰╯─") & set(str(caught.value))


def test_settings_as_flags_are_those_of_a_file(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(
        "[task]\nmax_force_N = 20\n[recording]\nenabled = false\n[perception]\nchannels = ['tx', 'ty']\n"
        "symbols = 'random'\n[learning.programmed]\n'x+ y0' = '-x'\n"
    )
    words = "--task.max-force-n 20 --recording.no-enabled --perception.channels tx ty --perception.symbols=random"
    assert config(*words.split(), "--learning.programmed", "x+ y0", "-x") == config("--config", str(file))
