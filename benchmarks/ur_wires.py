"""Communication faults of a Universal Robots arm, injected during a trial that uses the real client.

    python -m benchmarks.ur_wires                       all of them, about 12 s each
    python -m benchmarks.ur_wires --only "half frames"

An emulated UR5 and ATI box run in this process, and `palpate run --rig` runs in another. The fault is injected as soon
as the trial is running. The output says whether the run inserted the peg or ended, when the arm was stationary and the
process had ended, the last line of its output, and whether its log can be read.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.emulated_rig import PALPATE
from palpate.adapters.config import EmulationConfig, scenario
from palpate.adapters.hardware import EmulatedCell
from palpate.adapters.hardware.real_time import take_real_time
from palpate.adapters.log.reader import read_log
from palpate.core.trial import find_ready_pose
from palpate.simulation.emulators.ur import SafetyMode, UrController, UrServer

Strike = Callable[[UrServer, UrController], object]
SHORT_S = 0.03


def net(network: Callable[[bytes], bytes]) -> Strike:
    """Return a fault that applies a function to each data package from now on."""
    return lambda server, controller: setattr(server, "network", network)


def silence(data: bytes) -> bytes:
    return b""


def for_a_moment(server: UrServer, controller: UrController) -> None:
    before, server.network = server.network, silence
    threading.Timer(SHORT_S, lambda: setattr(server, "network", before)).start()


def once(garbage: bytes) -> Strike:
    """Return a fault that replaces the next data package."""
    waiting = [garbage]
    return net(lambda data: waiting.pop() if waiting else data)


def unplug(server: UrServer, controller: UrController) -> None:
    server.is_unplugged = True


def local(server: UrServer, controller: UrController) -> None:
    """Switch to local control, which ends a program that was sent remotely."""
    controller.remote = False
    controller.end_program()


def reboot(server: UrServer, controller: UrController) -> None:
    controller.reboot()
    server.is_unplugged = True


def replug(server: UrServer, controller: UrController) -> None:
    server.is_unplugged = True
    threading.Timer(0.5, lambda: setattr(server, "is_unplugged", False)).start()


TROUBLES: dict[str, Strike] = {
    "silence": net(silence),
    "silence of 30 ms": for_a_moment,
    "half frames": net(lambda data: data[:7]),
    "a header alone": net(lambda data: data[:3]),
    "a package shorter than its header": once(b"\x00\x01U"),
    "a package longer than the stream": once(b"\xff\xffU" + bytes(40)),
    "a text message": once(b"\x00\x09M\x02hi\x01x\x01"),
    "duplicates": net(lambda data: 2 * data),
    "unplugged": unplug,
    "unplugged and plugged again": replug,
    "connections cut": lambda server, controller: server._cut(),  # noqa: SLF001
    "reboot": reboot,
    "protective stop": lambda server, controller: controller.protective_stop(),
    "emergency stop": lambda server, controller: controller.emergency_stop(),
    "safeguard stop": lambda server, controller: setattr(controller, "safety_mode", SafetyMode.SAFEGUARD_STOP),
    "local control": local,
    "program stopped at the pendant": lambda server, controller: controller.end_program(),
}


def tried(strike: Strike, folder: Path) -> str:
    config = replace(scenario("paper"), seed=0, arm="ur5")
    rig, out, ended = folder / "rig.toml", folder / "out", threading.Event()
    emulation = EmulationConfig("ur-rtde", "ati-netft")
    with EmulatedCell(config, find_ready_pose(config.arm, config.tool.geometry, config.task), emulation) as cell:
        rig.write_text(cell.rig_toml("job.toml"))
        (folder / "job.toml").write_text(cell.job_toml())
        life = threading.Thread(target=cell.run, args=(ended.is_set, lambda truth: None))
        life.start()
        call = [*PALPATE, "run", "--rig", str(rig), "--policy", "torque", "--trials", "1"]
        call += ["--out", str(out), "--real-time.scheduling"]
        process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            log = out / "logs" / "trial-00000.mcap"
            while process.poll() is None and not (log.exists() and log.stat().st_size > 10_000):
                time.sleep(0.01)
            struck_s = time.monotonic()
            server: Any = cell.arm.server
            with server.exclusive() as controller:
                strike(server, controller)
            moved_s, ended_s = 0.0, None
            while ended_s is None or time.monotonic() - struck_s < ended_s + 1.0:
                if ended_s is None and process.poll() is not None:
                    ended_s = time.monotonic() - struck_s
                if not controller.stationary:
                    moved_s = time.monotonic() - struck_s
                time.sleep(0.005)
            _, complaint = process.communicate()
        finally:
            process.kill()
            ended.set()
            life.join()
    last = (complaint.strip().splitlines() or [""])[-1]
    if not log.exists():
        return f"NOT TRIED, the trial did not begin: {last}"
    ticks = len(read_log(log).ticks)
    if process.returncode == 0:
        return f"went on and inserted ({cell.insertions}), {ticks} ticks"
    result = f"at rest after {moved_s:.2f} s, ended after {ended_s:.2f} s, exit code {process.returncode}"
    return f"{result}, {ticks} ticks in the log: {last}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=tuple(TROUBLES))
    options = parser.parse_args()
    sys.stderr.write(f"{take_real_time(30)}\n")
    for name, strike in TROUBLES.items():
        if options.only in (None, name):
            with tempfile.TemporaryDirectory() as folder:
                print(f"{name}: {tried(strike, Path(folder))}", flush=True)


if __name__ == "__main__":
    main()
