"""``palpate replay``: the gate, batches with bad logs in them, and what-ifs."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from mcap.writer import Writer

from palpate.adapters.log.provenance import processor
from palpate.adapters.log.reader import RawMessage, read_log
from tests.integration.command_line import (
    QUICK,
    command,
    files_in,
    finished_trials,
    palpate,
    refusal,
    succeed,
    wait_until,
)
from tests.log_surgery import changed, in_start, indices, messages_of, one_ulp, write_log


def test_a_training_run_replays_and_hands_on_what_it_learned(trained: Path) -> None:
    before = files_in(trained)
    printed = succeed("replay", trained)
    assert "3 of 3 equal in every bit" in printed
    assert "each trial begins with the values that the one before ended with" in printed
    assert printed.count("trial-0000") == 3
    assert files_in(trained) == before


def test_one_trial_of_a_run_replays_alone_wherever_it_lies(trained: Path, tmp_path: Path) -> None:
    alone = shutil.copy(trained / "logs" / "trial-00002.mcap", tmp_path / "mine.mcap")
    assert "1 of 1 equal in every bit" in succeed("replay", alone, cwd=tmp_path)


def test_the_number_of_processes_changes_nothing(trained: Path) -> None:
    one, two = (
        re.sub(r"in [0-9.]+ s with.*", "", succeed("replay", trained, "--jobs", jobs, "--verbose")) for jobs in (1, 2)
    )
    assert one == two


def test_patterns_and_folders_name_each_log_once(trained: Path) -> None:
    pattern = trained / "logs" / "trial-0000[01].mcap"
    assert "2 of 2 equal" in succeed("replay", pattern)
    assert "3 of 3 equal" in succeed("replay", pattern, trained, trained / "logs" / "trial-00001.mcap")


@pytest.mark.parametrize("policy", ["omniscient", "torque", "spiral-10", "random"])
def test_comparators_replay(policy: str, tmp_path: Path) -> None:
    succeed("run", *QUICK, "--policy", policy, "--trials", 1, "--scenario", "blind", "--out", tmp_path / "run")
    assert "1 of 1 equal" in succeed("replay", tmp_path / "run")


def test_a_comparison_replays(tmp_path: Path, trained: Path) -> None:
    out = tmp_path / "compare"
    succeed("compare", *QUICK, "--policy", trained / "policy.json", "--trials", 1, "--out", out)
    assert {path.name for path in (out / "logs").iterdir()} == {
        "run", "omniscient", "torque", "spiral-10", "spiral-5", "random",
    }  # fmt: skip
    assert "6 of 6 equal" in succeed("replay", out)


def test_a_frozen_policy_replays(tmp_path: Path, trained: Path) -> None:
    succeed("run", *QUICK, "--policy", trained / "policy.json", "--trials", 1, "--out", tmp_path / "run")
    assert "1 of 1 equal" in succeed("replay", tmp_path / "run")


def test_an_interrupted_trial_replays_to_the_same_end(tmp_path: Path) -> None:
    out = tmp_path / "run"
    words = ("run", "--policy", "random", "--trials", 200, "--out", out, "--task.time-limit-s", 60)
    process = subprocess.Popen(command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: finished_trials(out) >= 1, process)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    finally:
        process.kill()
    last = sorted((out / "logs").glob("*.mcap"))[-1]
    printed = succeed("replay", last)
    assert "interrupted" in printed
    assert "1 of 1 equal" in printed


def test_a_difference_fails_and_is_named(trained: Path, tmp_path: Path) -> None:
    messages = messages_of(trained / "logs" / "trial-00001.mcap")
    tick = indices(messages, "/tick")[100]
    write_log(tmp_path / "changed.mcap", changed(messages, tick, one_ulp("asked_rad", 2)))
    done = palpate("replay", tmp_path, trained)
    assert done.returncode == 1
    assert "changed.mcap: tick 100, /tick asked_rad[2]: recorded " in done.stdout
    assert "no cause is known" in done.stdout
    assert "3 of 4 equal in every bit, 1 DIVERGED" in done.stdout


def test_known_causes_are_told(trained: Path, tmp_path: Path) -> None:
    messages = messages_of(trained / "logs" / "trial-00001.mcap")
    messages = changed(messages, indices(messages, "/tick")[100], one_ulp("asked_rad", 2))
    versions = {"palpate": "0.0.9", "numpy": "1.0", "scipy": "1.17.1", "pin": "4.1.0", "mujoco": "4.0.0"}
    messages = changed(messages, 0, in_start(versions_json=versions, core_sha256="0" * 64, model_sha256="1" * 64))
    done = palpate("replay", write_log(tmp_path / "old.mcap", messages))
    assert done.returncode == 1
    for cause in ("recorded with 0.0.9", "recorded with 1.0", "the core's code", "the model of the arm zebra-zero"):
        assert cause in done.stdout


def recorded_on(trained: Path, other: dict[str, object]) -> list[RawMessage]:
    """A trial of this machine that says that it was recorded on one that differs."""
    messages = messages_of(trained / "logs" / "trial-00001.mcap")
    return changed(messages, 0, in_start(processor_json=processor() | other))


def off_by_a_bit(messages: list[RawMessage]) -> list[RawMessage]:
    return changed(messages, indices(messages, "/tick")[100], one_ulp("asked_rad", 2))


@pytest.mark.parametrize(
    "other", [{"machine": "another"}, {"libc": "another"}, {"simd": ["X86_V2"]}], ids=["machine", "libc", "sine"]
)
def test_another_processor_may_differ_in_the_last_bits_only(
    trained: Path, tmp_path: Path, other: dict[str, object]
) -> None:
    messages = recorded_on(trained, other)
    log = write_log(tmp_path / "elsewhere.mcap", off_by_a_bit(messages))
    printed = succeed("replay", log)
    assert "not bit-comparable" in printed
    assert "another processor" in printed
    assert palpate("replay", log, "--strict").returncode == 1
    # Without a difference there is nothing to excuse; with a large one there is no excuse.
    assert "1 of 1 equal" in succeed("replay", write_log(tmp_path / "same.mcap", messages))
    gross = changed(messages, indices(messages, "/tick")[100], lambda made: made.asked_rad.__setitem__(2, 0.1))
    assert palpate("replay", write_log(tmp_path / "gross.mcap", gross)).returncode == 1
    decision = changed(messages, indices(messages, "/decision")[0], lambda made: setattr(made, "action", "none"))
    assert palpate("replay", write_log(tmp_path / "decision.mcap", decision)).returncode == 1


@pytest.mark.skipif("X86_V3" not in processor()["simd"], reason="a processor without fused multiply-add")
@pytest.mark.parametrize(
    "other",
    [{"blas": ["of another machine"]}, {"simd": ["X86_V2", "X86_V3"]}, {"simd": ["X86_V2", "X86_V3", "X86_V4"]}],
    ids=["BLAS", "AVX2", "AVX-512"],
)
def test_kernels_and_vector_loops_of_another_processor_excuse_nothing(
    trained: Path, tmp_path: Path, other: dict[str, object]
) -> None:
    done = palpate("replay", write_log(tmp_path / "kernels.mcap", off_by_a_bit(recorded_on(trained, other))))
    assert done.returncode == 1
    assert "another processor" not in done.stdout


@pytest.fixture
def mixed_bag(trained: Path, tmp_path: Path) -> Path:
    """A folder with one sound log and one of every bad kind."""
    sound = trained / "logs" / "trial-00001.mcap"
    data, messages = sound.read_bytes(), messages_of(sound)
    bag = tmp_path / "bag"
    bag.mkdir()
    shutil.copy(sound, bag / "sound.mcap")
    (bag / "empty.mcap").write_bytes(b"")
    (bag / "text.mcap").write_bytes(b"tick,force\n1,2\n")
    (bag / "truncated.mcap").write_bytes(data[: len(data) // 2])
    flipped = bytearray(data)
    flipped[len(data) // 2] ^= 4
    (bag / "flipped.mcap").write_bytes(flipped)
    (bag / "joined.mcap").write_bytes(data + data)
    (bag / "folder.mcap").mkdir()
    with (bag / "foreign.mcap").open("wb") as stream:
        foreign = Writer(stream)
        foreign.start("ros2", "another tool")
        schema = foreign.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        foreign.add_message(foreign.register_channel("/chatter", "cdr", schema), 0, b"hello", 0)
        foreign.finish()
    newer = changed(messages, 0, lambda made: setattr(made, "schema", "palpate.log/2"))
    write_log(bag / "newer.mcap", newer)
    ticks = indices(messages, "/tick")
    write_log(bag / "headless.mcap", [m for i, m in enumerate(messages) if i not in ticks[:5]])
    write_log(bag / "gap.mcap", [m for i, m in enumerate(messages) if i not in ticks[50:53]])
    return bag


def test_a_batch_goes_on_past_bad_logs_and_sums_up(mixed_bag: Path) -> None:
    before = files_in(mixed_bag)
    done = palpate("replay", mixed_bag)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr + done.stdout
    assert "1 of 11 equal in every bit, 10 NOT REPLAYABLE" in done.stdout
    for name, reason in {
        "empty": "is empty",
        "text": "offset 0: is no MCAP file",
        "truncated": "recover",
        "flipped": "is damaged",
        "joined": "two files were joined",
        "folder": "cannot be read",
        "foreign": "written by 'another tool', profile 'ros2'",
        "newer": "has schema 'palpate.log/2'",
        "headless": "the first 5 ticks are missing",
        "gap": "ticks 50 to 52 are missing",
    }.items():
        lines = [line for line in done.stdout.splitlines() if line.startswith(f"{mixed_bag}/{name}.mcap: ")]
        assert len(lines) == 1, name
        assert reason in lines[0]
    assert files_in(mixed_bag) == before


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((), "no log was named"),
        (("missing.mcap",), "missing.mcap: is not there"),
        (("no-such-*.mcap",), "is not there"),
        ((".",), "holds no logs"),
        (("LOG", "--set", "task.max_force=5"), "did you mean task.max_force_N"),
        (("LOG", "--set", "task.max_force_N=hard"), "task.max_force_N = 'hard'"),
        (("LOG", "--set", "task.max_force_N"), "name.of.field=value"),
        (("LOG", "--set", "task.max_force_N=-5"), "task.max_force_N"),
        (("LOG", "--set", "cell.peg.friction=0.5"), "a setting of the core"),
        (("LOG", "--set", "arm=ur5"), "a setting of the core"),
        (("LOG", "--policy", "nobody"), "a policy file, or one of omniscient"),
        (("LOG", "--config", "none.toml"), "none.toml"),
        (("LOG", "--continue-in-mujoco"), "a what-if"),
        (("LOG", "--out", "somewhere"), "a what-if"),
        (("LOG", "--jobs", "-1"), "jobs = -1"),
        (("LOG", "--speed", "2"), "--speed is not an option"),
    ],
)
def test_wrong_words_are_refused_in_one_line(
    trained: Path, tmp_path: Path, words: tuple[str, ...], reason: str
) -> None:
    named = [str(trained / "logs" / "trial-00001.mcap") if word == "LOG" else word for word in words]
    assert reason in refusal("replay", *named, cwd=tmp_path)


def test_a_log_of_another_arm_is_refused_with_a_configuration_given(trained: Path, tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text('arm = "ur5"\n')
    done = palpate("replay", trained / "logs" / "trial-00001.mcap", "--config", tmp_path / "other.toml")
    assert done.returncode == 2
    assert "was recorded with the arm 'zebra-zero'" in done.stdout


def test_another_configuration_is_a_known_cause(trained: Path, tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text("[task]\npress_kgf = 0.4\ntime_limit_s = 2.0\n")
    done = palpate("replay", trained / "logs" / "trial-00001.mcap", "--config", tmp_path / "other.toml")
    assert done.returncode == 1
    assert "known to be other: the configuration given" in done.stdout
    assert "counterfactual from tick" in done.stdout
    assert "3 of 3 equal" in succeed("replay", trained / "logs", "--config", trained / "run.toml")


def test_a_change_that_the_policy_cannot_serve_is_told(trained: Path) -> None:
    done = palpate("replay", trained / "logs" / "trial-00001.mcap", "--set", "task.step_mm=0.5")
    assert done.returncode == 2
    assert "displacement_mm" in done.stdout


def test_what_if_the_limit_had_been_tighter(trained: Path) -> None:
    log = trained / "logs" / "trial-00001.mcap"
    done = palpate("replay", log, "--set", "task.max_force_N=5.2")
    assert done.returncode == 1
    assert "force limit" in done.stdout
    assert "counterfactual from tick" in done.stdout
    assert "task.max_force_N=5.2" in done.stdout
    # A limit that was never reached would have changed nothing.
    assert "1 of 1 equal" in succeed("replay", log, "--set", "task.max_force_N=300")


def test_what_if_another_policy_had_acted(trained: Path, tmp_path: Path) -> None:
    log = trained / "logs" / "trial-00001.mcap"
    assert "counterfactual from tick" in palpate("replay", log, "--policy", "torque").stdout
    done = palpate("replay", log, "--policy", trained / "policy.json")
    assert done.returncode in (0, 1)
    assert "DIVERGED" in done.stdout or "equal" in done.stdout


def test_the_simulator_goes_on_from_the_first_other_command(trained: Path) -> None:
    log = trained / "logs" / "trial-00001.mcap"
    done = palpate("replay", log, "--policy", "omniscient", "--continue-in-mujoco")
    assert done.returncode == 1
    assert "inserted" in done.stdout
    assert "in the simulator: inserted after 0." in done.stdout
    # Where nothing is other, the simulator gives the recorded trial again, every sample held against the log.
    same = succeed("replay", log, "--set", "task.max_force_N=300", "--continue-in-mujoco")
    assert "1 of 1 equal" in same


def test_a_what_if_leaves_logs_that_say_what_they_are(trained: Path, tmp_path: Path) -> None:
    log, out = trained / "logs" / "trial-00001.mcap", tmp_path / "out"
    for words in (("--set", "task.max_force_N=5.2"), ("--policy", "torque", "--continue-in-mujoco")):
        done = palpate("replay", log, *words, "--out", out)
        assert done.returncode == 1
        tick = int(done.stdout.split("counterfactual from tick ")[1].split()[0])
        made = read_log(out / "trial-00001.mcap")
        assert made.start.derived_from == str(log)
        assert [record.counterfactual for record in made.records()] == [
            number >= tick for number in range(len(made.ticks))
        ]
        assert all(entry.counterfactual == (entry.tick >= tick) for entry in made.decisions + made.events)
        assert made.end is not None
        assert made.end.counterfactual
        # What the changed core did is reproducible like anything else, and the log is not overwritten.
        assert "1 of 1 equal" in succeed("replay", out)
        assert "is there already" in refusal("replay", log, *words, "--out", out)
        shutil.rmtree(out)


def test_what_ifs_of_logs_of_one_name_get_names_of_their_own(trained: Path, tmp_path: Path) -> None:
    twin = Path(shutil.copytree(trained / "logs", tmp_path / "twin"))
    words = ("--set", "task.max_force_N=300", "--out", tmp_path / "out")
    succeed("replay", trained / "logs", twin, *words)
    assert len(list((tmp_path / "out").glob("*.mcap"))) == 6


def test_the_simulator_does_not_go_on_from_what_it_did_not_record(trained: Path, tmp_path: Path) -> None:
    messages = messages_of(trained / "logs" / "trial-00001.mcap")
    words = ("--policy", "torque", "--continue-in-mujoco")
    arm = write_log(tmp_path / "arm.mcap", changed(messages, 0, in_start(world="zebra zero on serial")))
    assert "only the simulator can go on" in palpate("replay", arm, *words).stdout
    other = changed(messages, indices(messages, "/tick")[3], lambda made: made.wrench.force_N.__setitem__(0, 0.25))
    done = palpate("replay", write_log(tmp_path / "other.mcap", other), *words)
    assert done.returncode == 2
    assert "tick 3: this simulator gives another wrench than was recorded" in done.stdout
    world = json.loads(_start_of(messages).world_json) | {"model_sha256": "0"}
    model = write_log(tmp_path / "model.mcap", changed(messages, 0, in_start(world_json=world)))
    assert "this simulator's model is not the one" in palpate("replay", model, *words).stdout


def _start_of(messages: list) -> object:  # type: ignore[type-arg]
    found: list[object] = []
    changed(messages, 0, found.append)
    return found[0]
