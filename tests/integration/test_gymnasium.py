"""The environments as their users make them, and the proof that the core in them is that of every other run."""

import csv
import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from palpate.adapters import gymnasium_envs
from palpate.adapters.experiments import build_perception, learning_policy
from palpate.adapters.gymnasium_envs import PEG_INSERTION, PEG_INSERTION_6DOF
from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from palpate.core.policy import Observation, Transition, learner_of
from palpate.core.trial.report import Purpose, generator
from tests.command_line import TIMEOUT_S

NOWHERE = (0.0, 0.0, 0.0)
SHORT = {"task": {"time_limit_s": 0.5, "ready_height_mm": 1.0, "tare_ticks": 8}}
CORNERS = {"corners": 4, "corner_mm": 20.5}
SQUARE = {
    "scenario": "blind-square",
    "config": {"learner": "options", "task": {"time_limit_s": 2.5, "options": CORNERS}},
}
KINDS = [
    (PEG_INSERTION, {"config": SHORT, "actions": "continuous"}),
    (PEG_INSERTION, {"config": SHORT, "observations": "raw", "scenario": "blind", "arm": "ur5"}),
    (PEG_INSERTION_6DOF, {"config": SHORT, "observations": "raw", "actions": "continuous"}),
    (PEG_INSERTION_6DOF, SQUARE),
]


@pytest.mark.parametrize(
    ("name", "arguments"), [KINDS[1], *(pytest.param(*kind, marks=pytest.mark.nightly) for kind in KINDS[2:])]
)
def test_gymnasiums_own_checker_finds_nothing(name, arguments):
    # Warnings are errors here.
    env = gymnasium.make(name, **arguments)
    check_env(env.unwrapped)
    assert env.spec.to_json()
    env.close()


def test_environment_can_be_made_by_its_name_alone_and_names_load_nothing_heavy():
    program = (
        "import gymnasium, sys\n"
        "import palpate.adapters.gymnasium_envs\n"
        "print([name for name in ('mujoco', 'pinocchio', 'torch') if name in sys.modules])\n"
        "del sys.modules['palpate.adapters.gymnasium_envs']\n"
        "gymnasium.registry.clear()\n"
        f"env = gymnasium.make('palpate.adapters.gymnasium_envs:{PEG_INSERTION}')\n"
        "print(env.unwrapped.spec.id, env.reset(seed=1)[0] in env.observation_space)"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    assert (done.stdout, done.stderr) == (f"[]\n{PEG_INSERTION} True\n", "")


def test_without_gymnasium_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.setitem(sys.modules, "gymnasium.envs.registration", None)
    with pytest.raises(ModuleNotFoundError, match=r"need Gymnasium: pip install 'palpate\[gymnasium\]'"):
        runpy.run_path(str(gymnasium_envs.__file__))


def in_bytes(*parts):
    """Everything that an environment returned, to the last bit; floats too, and types."""
    return b"|".join(
        part.dtype.str.encode() + part.tobytes() if isinstance(part, (np.ndarray, np.generic))
        else in_bytes(*(x for pair in part.items() for x in pair)) if isinstance(part, dict)
        else part.hex().encode() if isinstance(part, float)
        else repr(part).encode()
        for part in parts
    )  # fmt: skip


def episodes(env, seed, count, steps=4):
    """Episodes under random actions, the same for the same seed."""
    env.action_space.seed(seed)
    said = []
    for episode in range(count):
        said.append(in_bytes(*env.reset(seed=seed if episode == 0 else None)))
        for _ in range(steps):
            answer = env.step(env.action_space.sample())
            said.append(in_bytes(*answer))
            if answer[2] or answer[3]:
                break
    return said


@pytest.mark.parametrize(("name", "arguments"), [KINDS[3], pytest.param(*KINDS[0], marks=pytest.mark.nightly)])
def test_equal_seeds_and_actions_give_equal_bytes_whatever_was_before(name, arguments):
    env, other = gymnasium.make(name, **arguments), gymnasium.make(name, **arguments)
    first = episodes(env, 7, 2)
    between = episodes(env, 8, 1)
    env.reset(seed=99)
    env.step(env.action_space.sample())  # an episode that is left in its middle
    assert episodes(env, 7, 2) == first
    assert episodes(other, 7, 2) == first
    assert between[: len(first)] != first[: len(between)]
    env.close()
    other.close()


def test_example_of_the_guide_inserts_a_square_peg_by_options(capsys):
    guide = (Path(__file__).parents[2] / "docs/how-to/use-gymnasium.md").read_text(encoding="utf-8")
    section = guide.partition("## palpate/PegInsertion6Dof-v0")[2]
    exec(section.split("```python\n")[1].partition("```")[0], {})
    assert re.fullmatch(r"inserted tilt 1, push 1, stand 1(, insert)?\n", capsys.readouterr().out)


def learn_outside(env, policy, seed, trials, notify):
    """Let a policy of palpate act and learn through the environment, with the information that any agent receives."""
    for trial in trials:
        state, info = env.reset(seed=seed, options={"trial": trial})
        assert info["trial"] == trial
        policy.begin_trial(trial, generator(seed, Purpose.POLICY, trial))
        over, number = False, 0
        while not over:
            decision = policy.choose(Observation(int(state), NOWHERE, NOWHERE, NOWHERE, NOWHERE, number))
            after, reward, terminated, truncated, info = env.step(decision.index)
            policy.learn(Transition(int(state), decision.index, reward, None if terminated else int(after)))
            state, over, number = after, terminated or truncated, number + 1
        notify(trial, terminated, info)


@pytest.mark.parametrize(
    ("arguments", "words", "outcomes"),
    [
        # With this seed two of the paper's trials insert the peg and one does not.
        ({"config": {"task": {"time_limit_s": 1.5}}}, "--task.time-limit-s 1.5", {"inserted", "time limit"}),
        pytest.param(
            {"task": "insertion-6dof", **SQUARE},
            "--task.time-limit-s 2.5 --scenario blind-square --task insertion-6dof --learner options"
            " --task.options corners 4 corner_mm 20.5",
            {"time limit"},
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_learner_has_the_same_trials_through_the_environment(palpate, tmp_path, arguments, words, outcomes):
    seed, trials = 18, 3
    always = ("--trials", trials, "--seed", seed, "--recording.no-enabled", "--out", tmp_path)
    palpate.succeed("train", *words.split(), *always)
    with (tmp_path / "trials.csv").open(encoding="utf-8", newline="") as stream:
        expected = list(csv.DictReader(stream))
    env = PegInsertionEnv(**arguments, failure_penalty=0.0)
    run = env._episodes.config
    policy = learning_policy(run, build_perception(run))
    rows = []

    def notify(trial, terminated, info):
        rows.append(
            {
                "trial": str(trial),
                "outcome": info["outcome"],
                "success": str(info["is_success"]),
                "exploration_time_s": str(round(info["exploration_time_s"], 6)),
                "actions": str(info["decisions"]),
                "peak_force_N": str(round(info["peak_force_N"], 6)),
                "depth_mm": str(round(info["true_depth_m"] * 1e3, 6)),
                "ticks": str(round(info["time_s"] * 140)),
            }
        )

    learn_outside(env, policy, seed, range(trials), notify)
    env.close()
    assert rows == [{name: row[name] for name in rows[0]} for row in expected]
    assert {row["outcome"] for row in rows} >= outcomes
    # What was learned is the same to the last bit.
    learner = learner_of(policy)
    checkpoint = json.loads((tmp_path / "checkpoint.json").read_text(encoding="utf-8"))
    assert json.loads(json.dumps(learner.get_state())) == checkpoint["learner"]
