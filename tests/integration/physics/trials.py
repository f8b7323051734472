"""Whole trials of a random walk through the ports, for tests of the cell rather than of learning."""

import hashlib

from palpate.adapters.experiments.build import build_perception, build_task, task_actions
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.policy import RandomWalkPolicy
from palpate.core.ports.devices import Ports
from palpate.core.trial.report import TrialSetup
from tests.support.physics_bench import ready_pose


class _Tapped:
    """A device whose readings and commands go through a digest; their times and numbers belong to the run."""

    def __init__(self, device, digest):
        self._device, self._digest = device, digest

    def read(self):
        sample = self._device.read()
        values = (sample.force_N, sample.torque_Nm) if hasattr(sample, "force_N") else sample.position_rad
        self._digest.update(repr(values).encode())
        return sample

    def send(self, command):
        self._digest.update(repr(command.position_rad).encode())
        return self._device.send(command)

    def stop(self):
        self._device.stop()


def random_walk(rig, config, index, start_m, digest=None):
    """Run one trial; with a digest, every sensor sample and joint command goes into it."""
    task = build_task(config, ready_pose(config.arm), build_perception(config), RandomWalkPolicy(task_actions(config)))
    ports = rig.ports
    if digest is not None:
        devices = (ports.force_sensor, ports.joint_encoder, ports.arm)
        tapped = [_Tapped(device, digest) for device in devices]
        ports = Ports(ports.clock, *tapped)
    rig.prepare(index)
    return run_trial(task, ports, TrialSetup(index, config.seed, start_m))


def digests(config, indices):
    """One digest a trial, run one after the other in one cell: samples, commands and the truth at the end."""
    results = []
    with SimulatedRig(config, ready_pose(config.arm)) as rig:
        for index in indices:
            digest = hashlib.sha256()
            random_walk(rig, config, index, (1e-3 * (index % 3), -1e-3), digest)
            digest.update(repr(rig.truth()).encode())
            results.append(digest.hexdigest())
    return results
