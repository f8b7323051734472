"""A trial is a function of configuration, seed and number: to the last bit, in any process, after any other trial."""

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import ChosenPolicy, Run


def short_run(arm):
    config = RunConfig(arm=arm, seed=7)
    # A hole that lies elsewhere in every trial, and time enough for some tens of steps.
    return replace(
        config, task=replace(config.task, time_limit_s=1.5), cell=replace(config.cell, hole_uncertainty_mm=3.0)
    )


def digests(config, numbers):
    """One a trial, run one after the other in one cell: of all that was reported, and the truth at the end."""
    with Run(config) as run:
        trials = run.trials(ChosenPolicy("random", config))
        message = [repr((scored.report.events, scored.truth)) for scored in map(trials.run, numbers)]
    return [hashlib.sha256(text.encode()).hexdigest() for text in message]


@pytest.mark.parametrize(
    ("variables", "needed"),
    [
        pytest.param({}, "", marks=pytest.mark.nightly),
        ({"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"}, "pni"),
        pytest.param({"OPENBLAS_CORETYPE": "Haswell"}, "avx2", marks=pytest.mark.nightly),
        pytest.param({"OPENBLAS_CORETYPE": "SkylakeX"}, "avx512bw", marks=pytest.mark.nightly),
    ],
)
def test_fresh_process_repeats_every_command_and_sample_on_any_processor(variables, needed):
    if needed and needed not in Path("/proc/cpuinfo").read_text().split():
        pytest.skip(f"this processor has no {needed}: its kernels would end the process")
    program = (
        "from tests.integration.physics import test_reproducible as t\n"
        "print(*t.digests(t.short_run('zebra-zero'), range(2)))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONHASHSEED": "random", **variables}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    here = digests(short_run("zebra-zero"), range(2))
    assert len(set(here)) == 2
    assert done.stdout.split() == here


def test_trial_alone_equals_the_trial_in_a_sequence():
    config = short_run("zebra-zero")
    sequence = digests(config, range(3))
    assert len(set(sequence)) == 3
    assert digests(config, [2, 0]) == [sequence[2], sequence[0]]
