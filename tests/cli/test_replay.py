"""``palpate replay``: the gate, batches with bad logs in them, and what-ifs."""

import json
import re
import shutil
from pathlib import Path

import pytest

from palpate.adapters.log import decisive, processor, read_log
from tests.command_line import files_in
from tests.support.log_surgery import changed, in_start, indices, messages_of, one_ulp, write_log


@pytest.fixture
def log(trained):
    """A recorded trial in which the policy learned."""
    return trained / "logs" / "trial-00001.mcap"


@pytest.fixture
def messages(log):
    """The messages of that trial."""
    return messages_of(log)


def test_a_training_run_replays_on_any_number_of_processes(palpate, trained):
    before = files_in(trained)
    one, two, unasked = (palpate.succeed("replay", trained, "--jobs", jobs, "--verbose") for jobs in (1, 2, 0))
    assert "with 2 processes" in two
    assert "with 1 process\n" in unasked
    assert "3 of 3 equal in every bit" in one
    assert one.count("trial-0000") == 3
    duration = r"in [0-9.]+ s with.*"
    assert re.sub(duration, "", one) == re.sub(duration, "", two)
    assert files_in(trained) == before


def test_all_strategies_of_a_comparison_replay(palpate, compared):
    assert {path.name for path in (compared / "logs").iterdir()} == {
        "run", "run-1", "oracle", "torque", "spiral-10", "spiral-5", "random",
    }  # fmt: skip
    assert "14 of 14 equal" in palpate.succeed("replay", compared, "--jobs", 1)


def test_a_difference_fails_and_is_named(palpate, trained, messages, tmp_path):
    write_log(tmp_path / "changed.mcap", off_by_a_bit(messages))
    done = palpate("replay", tmp_path, trained, "--jobs", 1)
    assert done.code == 1
    assert "changed.mcap: tick 100, /tick requested_rad[2]: recorded " in done.stdout
    assert "no cause is known" in done.stdout
    assert "3 of 4 equal in every bit, 1 DIVERGED" in done.stdout


def test_known_causes_are_named(palpate, messages, tmp_path):
    versions = {"palpate": "0.0.9", "numpy": "1.0", "scipy": "1.17.1", "pin": "4.1.0", "mujoco": "4.0.0"}
    other = in_start(versions_json=versions, core_sha256="0" * 64, model_sha256="1" * 64)
    done = palpate("replay", write_log(tmp_path / "old.mcap", changed(off_by_a_bit(messages), 0, other)))
    assert done.code == 1
    for cause in ("recorded with 0.0.9", "recorded with 1.0", "the core's code", "the model of the arm zebra-zero"):
        assert cause in done.stdout


def off_by_a_bit(messages):
    return changed(messages, indices(messages, "/tick")[100], one_ulp("requested_rad", 2))


def test_another_processor_may_differ_in_the_last_bits_only(palpate, messages, tmp_path):
    messages = changed(messages, 0, in_start(processor_json=processor() | {"libc": "another"}))
    log = write_log(tmp_path / "elsewhere.mcap", off_by_a_bit(messages))
    printed = palpate.succeed("replay", log)
    assert "not bit-comparable" in printed
    assert "another processor" in printed
    assert palpate("replay", log, "--strict").code == 1
    # Without a difference there is nothing to excuse; with a large one there is no excuse.
    assert "1 of 1 equal" in palpate.succeed("replay", write_log(tmp_path / "same.mcap", messages))
    gross = changed(messages, indices(messages, "/tick")[100], lambda made: made.requested_rad.__setitem__(2, 0.1))
    assert palpate("replay", write_log(tmp_path / "gross.mcap", gross)).code == 1
    decision = changed(messages, indices(messages, "/decision")[0], lambda made: setattr(made, "action", "none"))
    assert palpate("replay", write_log(tmp_path / "decision.mcap", decision)).code == 1


@pytest.mark.skipif("X86_V3" not in processor()["simd"], reason="a processor without fused multiply-add")
@pytest.mark.parametrize(
    ("other", "excuses"),
    [
        ({"libc": "another"}, True),
        ({"simd": ["X86_V2"]}, True),
        ({"blas": ["of another machine"]}, False),
        ({"simd": ["X86_V2", "X86_V3", "X86_V4"]}, False),
    ],
)
def test_kernels_and_vector_loops_of_another_processor_excuse_nothing(other, excuses):
    assert (decisive(processor() | other) != decisive(processor())) is excuses


def test_a_batch_goes_on_past_bad_logs_and_sums_up(palpate, log, messages, tmp_path):
    data = log.read_bytes()
    (tmp_path / "sound.mcap").write_bytes(data)
    (tmp_path / "truncated.mcap").write_bytes(data[: len(data) // 2])
    (tmp_path / "folder.mcap").mkdir()
    ticks = indices(messages, "/tick")
    write_log(tmp_path / "headless.mcap", [m for i, m in enumerate(messages) if i not in ticks[:5]])
    write_log(tmp_path / "gap.mcap", [m for i, m in enumerate(messages) if i not in ticks[50:53]])
    before = files_in(tmp_path)
    done = palpate("replay", tmp_path, "--jobs", 1)
    assert done.code == 2
    assert "Traceback" not in done.stderr + done.stdout
    assert "1 of 5 equal in every bit, 1 equal as far as it can be read, 3 NOT REPLAYABLE" in done.stdout
    for name, reason in {
        "truncated": "the recording was cut short",
        "folder": "is no file",
        "headless": "ticks 0 to 4 are missing",
        "gap": "ticks 50 to 52 are missing",
    }.items():
        (line,) = [line for line in done.stdout.splitlines() if line.startswith(f"{tmp_path}/{name}.mcap: ")]
        assert reason in line
    assert files_in(tmp_path) == before


def test_a_change_that_the_policy_cannot_serve_is_refused(palpate, log):
    done = palpate("replay", log, "--set", "task.step_mm=0.5")
    assert done.code == 2
    assert "displacement_mm" in done.stdout


def test_what_if_the_limit_had_been_tighter(palpate, log):
    done = palpate("replay", log, "--set", "task.max_force_N=5.2")
    assert done.code == 1
    for word in ("force limit", "counterfactual from tick", "task.max_force_N=5.2"):
        assert word in done.stdout
    # A limit that was never reached would have changed nothing.
    assert "1 of 1 equal" in palpate.succeed("replay", log, "--set", "supervision.retract_mm=16")


def test_the_simulator_goes_on_from_the_first_other_command(palpate, log):
    done = palpate("replay", log, "--policy", "oracle", "--continue-in-mujoco")
    assert done.code == 1
    assert "in the simulator: inserted after 0." in done.stdout
    # Where nothing is other, the simulator gives the recorded trial again, every sample held against the log.
    same = palpate.succeed("replay", log, "--set", "supervision.retract_mm=16", "--continue-in-mujoco")
    assert "1 of 1 equal" in same


def test_the_simulator_goes_on_in_the_cell_that_recorded_a_log(palpate):
    # Its peg is tilted.
    log = Path(__file__).parents[1] / "golden" / "wedged.mcap"
    same = palpate.succeed("replay", log, "--set", "supervision.retract_mm=16", "--continue-in-mujoco")
    assert "1 of 1 equal" in same


def test_what_ifs_leave_logs_marked_as_such(palpate, log, tmp_path):
    words = "--policy torque --continue-in-mujoco"
    done = palpate("replay", log, *words.split(), "--out", "out")
    assert done.code == 1
    tick = int(done.stdout.split("counterfactual from tick ")[1].split()[0])
    made = read_log(tmp_path / "out" / "trial-00001.mcap")
    assert made.start.derived_from == str(log)
    assert [record.counterfactual for record in made.records()] == [number >= tick for number in range(len(made.ticks))]
    assert all(entry.counterfactual == (entry.tick >= tick) for entry in made.decisions + made.events)
    assert made.end.counterfactual
    # What the changed core did is reproducible like anything else, and the log is not overwritten.
    assert "1 of 1 equal" in palpate.succeed("replay", "out")
    assert "is there already" in palpate.refusal("replay", log, *words.split(), "--out", "out")


def test_what_ifs_of_logs_of_one_name_get_names_of_their_own(palpate, log, tmp_path):
    (tmp_path / "twin").mkdir()
    shutil.copy(log, tmp_path / "twin")
    palpate.succeed("replay", log, "twin", "--set", "supervision.retract_mm=16", "--out", "out")
    assert len(list((tmp_path / "out").glob("*.mcap"))) == 2


def test_the_simulator_does_not_go_on_from_what_it_did_not_record(palpate, messages, tmp_path):
    def message(changed_messages):
        log = write_log(tmp_path / "log.mcap", changed_messages)
        done = palpate("replay", log, "--policy", "torque", "--continue-in-mujoco")
        log.unlink()
        assert done.code == 2
        return done.stdout

    def another_model(start):
        start.world_json = json.dumps(json.loads(start.world_json) | {"model_sha256": "0"})

    assert "only the simulator can continue it" in message(changed(messages, 0, in_start(world="zebra zero on serial")))
    other = changed(messages, indices(messages, "/tick")[3], lambda made: made.wrench.force_N.__setitem__(0, 0.25))
    assert "tick 3: this simulator gives another wrench than was recorded" in message(other)
    assert "this simulator's model differs" in message(changed(messages, 0, another_model))
