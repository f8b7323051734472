"""The unchanged core over emulated devices in a process of their own: serial lines, slcan, real time."""

import json
import os
import re
import signal
import subprocess
from contextlib import contextmanager
from pathlib import Path

import pytest

from palpate.adapters.log import read_log
from tests.command_line import RT_EMULATOR, TIMEOUT_S, CommandLine, command, finished_trials, wait_until
from tests.wall_clock.late import TooLateError

PATIENT = (
    *("--supervision.max-tracking-error-mrad", 100, "--supervision.max-gap-ms", 1000),
    *("--supervision.max-force-age-ms", 1000, "--supervision.max-joint-age-ms", 1000),
    *("--supervision.max-repeats", 140, "--supervision.max-force-N", 40, "--supervision.unexpected-contact-N", 30),
    *("--supervision.max-equal-samples", 1000, "--supervision.flat-line-samples", 1000),
    *("--supervision.max-force-rate-N-s", 30_000, "--supervision.weakened"),
    *("max_force_N", "max_force_rate_N_s", "unexpected_contact_N", "max_tracking_error_mrad", "max_gap_ms"),
    *("max_force_age_ms", "max_joint_age_ms", "max_repeats", "max_equal_samples", "flat_line_samples"),
    "--real-time.scheduling",
)
"""The supervisor's share of what :func:`relax` does.

An emulated world that other work has held up goes on with a jerk: the tool's own mass then pulls at the sensor.
"""


def relax(rig):
    """Allow for a machine that is busy with other tests: what is tested here is not how fast it is."""
    text = rig.read_text()
    arm, sensor = text.split("[force_sensor]\n")
    timeout_scale = "" if "timeout_scale" in arm else "timeout_scale = 8.0\n"
    arm = arm.replace("[arm]\n", f"[arm]\nmax_age_ms = 1000.0\n{timeout_scale}")
    arm = arm.replace("[rig]\n", "[rig]\napproach_rad_s = 0.8\n")
    sensor = sensor.replace("setpoint_timeout_ms = 500.0", "setpoint_timeout_ms = 2000.0")
    rig.write_text(f"{arm}[force_sensor]\nmax_age_ms = 1000.0\n{sensor}")


@contextmanager
def emulated(rig, *words):
    """An emulated rig that is served; its rig file is at ``rig``."""
    call = command("emulate", "--rig-file", rig, *RT_EMULATOR, *words)
    process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: rig.exists() and "[force_sensor]" in rig.read_text(), process)
        relax(rig)
        yield process
    finally:
        process.kill()
        process.communicate()


def logs(out):
    """In the order of their trials; the last is of the one that is under way, or was when the run ended."""
    return sorted((out / "logs").glob("trial-*.mcap"))


def is_to_be_cut(out):
    """Whether a trial is under way of which two seconds are on disk, with the contact."""
    return len(logs(out)) > finished_trials(out) and logs(out)[-1].stat().st_size > 60_000


LATE = re.compile("fault|silent|no set-point for|no new|age|gap|late|a force above")
"""What a run says that ended because something came late."""


def require_in_time(complaint):
    """Nothing that a host may bring about which came late."""
    assert "Traceback" not in complaint
    if LATE.search((complaint.strip().splitlines() or [""])[-1]):
        raise TooLateError(complaint)


@contextmanager
def running(rig, out, policy, terminal=None):
    """A run in the middle of a trial; its output goes to the terminal, if there is one."""
    words = ("run", "--rig", rig, "--policy", policy, "--trials", 50, "--out", out, *PATIENT)
    own = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    if terminal is not None:
        own = {"stdin": terminal, "stdout": terminal, "stderr": terminal, "preexec_fn": lambda: os.login_tty(terminal)}
    process = subprocess.Popen(command(*words), text=True, **own)
    try:
        try:
            wait_until(lambda: is_to_be_cut(out), process)
        except AssertionError as error:
            process.kill()
            complaint = process.communicate()[1] or ""
            require_in_time(complaint)
            raise AssertionError(complaint) from error
        yield process
    finally:
        process.kill()
        process.communicate()


def require_equal(out, last):
    """What was recorded over real wires, to the cut, comes out of the core again, bit for bit."""
    trials = len(logs(out))
    replayed = CommandLine().succeed("replay", out, "--jobs", 1)
    assert f"{trials} of {trials} equal in every bit" in replayed, last
    return replayed


def test_doctor_finds_both_devices_and_a_cable_pulled_in_mid_motion_ends_the_run_with_a_log(tmp_path, monkeypatch):
    rig, out = tmp_path / "rig.toml", tmp_path / "out"
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2] / "examples" / "third_party_policies"))
    with emulated(rig, "--wires", "zebra-nmc", "--force", "jr3-can") as devices:
        examined = CommandLine()("rig", "doctor", "--rig", rig, "--seconds", "0.3")
        # What it says of rates and latencies is the host's affair here.
        for found in ("modules 6, servo", "ok limits", "ok noise"):
            assert found in " ".join(examined.stdout.split())
        with running(rig, out, "third_party_policies.drift:Drift") as process:
            devices.send_signal(signal.SIGKILL)
            _, complaint = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 1
    assert "Traceback" not in complaint
    last = complaint.strip().splitlines()[-1]
    assert last.startswith("palpate: ")
    assert any(word in last for word in ("fault", "silent", "safety trip", "gone")), last
    # The trial that was cut off is recorded up to there, with what ended it.
    # Here, without the stranger's package, the decisions come from the log.
    taken = f"of {len(logs(out))} of them the decisions come from the log"
    assert taken in require_equal(out, last)


@pytest.mark.nightly
def test_a_closed_terminal_and_the_operator_s_signal_stop_the_arm_and_leave_whole_logs(tmp_path):
    rig, out, closed = tmp_path / "rig.toml", tmp_path / "out", tmp_path / "closed"
    with emulated(rig, "--wires", "cia402", "--force", "jr3-can"):
        master, slave = os.openpty()
        with running(rig, closed, "random", slave) as process:
            os.close(slave)
            os.close(master)
            code = process.wait(TIMEOUT_S)
        # Where the terminal's keys were watched, its end is a fault.
        rig.with_name("rig.toml.fault.json").unlink(missing_ok=True)
        with running(rig, out, "random") as process:
            process.send_signal(signal.SIGUSR1)
            _, complaint = process.communicate(timeout=TIMEOUT_S)
    log = read_log(logs(closed)[-1])
    assert log.end is not None, f"the log has no end; exit code {code}"
    if log.end.outcome not in ("interrupted", "stopped from outside"):
        require_in_time(f"{log.end.outcome} {log.end.error} {log.end.stopped_by}")
    assert code in (1, 130)
    assert log.calls[-1].call == "stop"
    require_equal(closed, code)
    assert process.returncode == 1
    assert "Traceback" not in complaint
    assert "the arm was stopped, signal: signal SIGUSR1" in complaint
    end = json.loads(CommandLine().succeed("log", "info", "--json", logs(out)[-1]))[0]["end"]
    assert end["stopped_by"] == "signal: signal SIGUSR1", end
    assert {"perceive", "decide", "control"} <= {name for name, ns in end["timing"]["longest_ns"].items() if ns}
    require_equal(out, complaint)
