"""Command-line options for the commands that load the simulator.

This module does not load the simulator, so that ``--help`` and invalid arguments get an immediate response. Other
commands define their options in their own modules.
"""

from copy import copy
from dataclasses import dataclass, field
from typing import Annotated, Self, TypeAlias

import tyro

from palpate.adapters.config import LEARNERS, RARE, SCENARIOS, TRIALS, EmulationConfig, GridLearning, RunConfig
from palpate.core.ports import OneOf, Range, Settings

Trials: TypeAlias = Annotated[int, Range(1, 1_000_000)]
Jobs: TypeAlias = Annotated[int, Range(0, 1024)]


@dataclass(frozen=True)
class RunSettings(Settings):
    """Options common to all commands that run trials.

    Attributes:
        run: Configuration that results from files, presets and flags.
    """

    job: str = ""
    """Job file: part, tool, arm, place and limits. All other settings are derived from it. Default: the paper's peg."""
    scenario: Annotated[str, OneOf("", *SCENARIOS)] = ""
    """Conditions for the simulated trials: job, paper, blind, or blind with an additional condition, such as
    blind-tilt-4. Default: job with --job, else paper."""
    task: str = ""
    """Task: insertion, insertion-6dof, or a task from a plug-in package. Default: insertion."""
    arm: str = ""
    """Name of the arm, such as ur5e. To use your own arm, add an [arm] table to the job file."""
    learner: Annotated[str, OneOf("", *LEARNERS)] = ""
    """Name of the learner. Default: the policy file's learner, else q-learning."""
    seed: Annotated[int, Range(-1, 2**63 - 1, text=f"a whole number from 0 to {2**63 - 1}")] = -1
    """Seed for all random streams. Default: 0."""
    config: str = ""
    """TOML file with settings, such as a run.toml. It overrides the job file; flags override both."""
    run: RunConfig = field(default_factory=RunConfig, init=False)

    def with_run(self, run: RunConfig) -> Self:
        """Return the same options with a different configuration."""
        other = copy(self)
        object.__setattr__(other, "run", run)
        return other


@dataclass(frozen=True, kw_only=True)
class LiveSettings(Settings):
    """Options common to all commands with a live view."""

    live: bool = False
    """Show running trials in Rerun; each tick then takes longer. Install it with: pip install 'palpate[rerun]'."""
    live_port: Annotated[int, Range(0, 65535), RARE] = 0
    """Port on this computer to which the viewer connects; 0 uses Rerun's default, 9876."""


@dataclass(frozen=True, kw_only=True)
class AcknowledgeSettings(Settings):
    """Options common to all commands that move a rig."""

    accept_kinematics: Annotated[bool, RARE] = False
    """Allow motion with the arm's nominal model, which may be off by up to 10 mm. A rig file with the arm's own
    calibration does not need this."""

    acknowledge: Annotated[str, RARE] = ""
    """Allow a rig to move after a fault: "NUMBER NAME: why", with the fault's number, your name, and the reason why it
    is safe. This clears only that fault, once, and only if no device still reports it."""


@dataclass(frozen=True, kw_only=True)
class MotionSettings(AcknowledgeSettings):
    """Options common to all commands that run trials on a rig."""

    rig: str = ""
    """Rig file; its devices are used instead of the simulator."""
    confirm: Annotated[str, RARE] = ""
    """Name of the rig, to allow motion with --rig if there is no terminal. At a terminal, palpate asks once. An
    emulated rig needs no confirmation."""


@dataclass(frozen=True)
class TrainOptions(MotionSettings, LiveSettings, RunSettings):
    """Train a policy for an insertion, and save the policy, logs and results in a folder."""

    trials: Trials = 350
    """Number of trials."""
    out: str = ""
    """Folder for the results. It must not contain a run. Default: runs/SCENARIO."""
    policy: str = "q-learning"
    """q-learning: train the learner given by --learner from scratch. A policy file: continue its training, with the
    initial exploration. package.module:Name or the name of an entry point: train a learner from a plug-in package."""
    resume: bool = False
    """Resume the stopped run in --out, with its settings and the same random streams."""
    from_logs: tuple[str, ...] = ()
    """Fit the belief learner to recorded trials with any policy, without running trials. Takes logs, folders with logs,
    or patterns in quotes, with the newest last; uses the settings in the first log."""


@dataclass(frozen=True)
class RunOptions(MotionSettings, LiveSettings, RunSettings):
    """Run a trained policy or a baseline without learning."""

    policy: str = ""
    """Policy file; baseline: oracle, torque, spiral-10, spiral-5 or random; or a policy from a plug-in package:
    package.module:Name or the name of its entry point."""
    trials: Trials = 50
    """Number of trials."""
    dry: bool = False
    """With --rig: read, decide and log without sending commands to the arm. Each trial ends soon after the tare."""
    out: str = ""
    """Folder for the results. It must not contain a run. Default: runs/SCENARIO-run-001 or the next free number."""
    claim: str = ""
    """Claim about the policy, such as "success >= 0.99". The exact 95 % interval proves it, refutes it or is
    inconclusive. The exit code is 0 only for a proved claim."""
    jobs: Jobs = 1
    """Number of simulator processes; 0 uses one per core. With more than one, each block of 10 trials uses a new policy
    object."""
    learner: Annotated[str, OneOf("", *LEARNERS), RARE] = ""
    """Learner whose presets apply. Default: the policy file's learner, else q-learning."""
    view: bool = False
    """Show the simulation in MuJoCo's viewer in real time. Closing the window ends the run."""


@dataclass(frozen=True)
class CompareOptions(RunSettings):
    """Compare hand-written strategies and trained policies on the same trials."""

    policy: tuple[str, ...] = ()
    """Policies to compare with the baselines: policy files or package.module:Name."""
    trials: Trials = 50
    """Number of trials per policy."""
    out: str = ""
    """Folder for the table. It must not contain a run. Default: runs/SCENARIO-compare."""


@dataclass(frozen=True)
class PlanOptions(Settings):
    """Check whether a job is feasible, and print its derived settings and the best task and policy. Nothing moves.

    With --trials it also simulates the job. Each trial uses a different cell, drawn from uniform distributions: the
    hole in its circle, plate height, tilt (from 0), friction (from 0.1 to the maximum), noise (factor 0.8 to 1.25),
    stiffness (factor 0.9 to 1.1), headings and yaw. Each block of 10 trials starts with a new policy object. The first
    trial of a block trains a learner and does not count.

    Exit code 0: feasible; 1: not feasible; 2: the job or an option is invalid.
    """

    job: Annotated[str, tyro.conf.Positional]
    """Job file: part, tool, arm, place and limits."""
    task: Annotated[str, OneOf("", "insertion", "insertion-6dof")] = ""
    """Task: insertion or insertion-6dof. Default: the more suitable one."""
    arm: str = ""
    """Name of an arm to use instead of the job's arm."""
    trials: Annotated[int, Range(0, 1_000_000)] = 0
    """Number of simulated trials; 0 disables the simulation."""
    jobs: Jobs = 1
    """Number of processes; 0 uses one per core. The result does not depend on it."""
    seed: Annotated[int, Range(0, 2**63 - 1)] = 0
    """Seed for all random streams in the simulated trials."""
    out: str = ""
    """New .png, .svg or .pdf file for a plot of the trials. Default: JOB-plan.png."""


@dataclass(frozen=True)
class ReplayOptions(Settings):
    """Feed recorded trials back through the core and compare every command and decision bit by bit.

    Exit code 0: all identical; 1: some differ; 2: a log or an option is invalid. With --policy or --set the replay is
    a what-if. Exit code 1 then means that the trial would have differed; everything after the first different command
    is marked counterfactual.
    """

    logs: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Logs, folders that contain logs, or patterns in quotes."""
    policy: str = ""
    """What-if: use a different policy: a policy file, oracle, torque, spiral-10, spiral-5, random, or
    package.module:Name."""
    set: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """What-if: change a setting, as in --set task.max_force_N=20. May be repeated."""
    continue_in_mujoco: bool = False
    """What-if: continue in the simulator from the first different command; only for logs of simulated trials."""
    out: str = ""
    """New folder for the logs from a what-if."""
    strict: bool = False
    """Fail even if only the least significant bits differ from a log recorded on a different processor."""
    jobs: Jobs = 0
    """Number of processes; 0 uses one per thirty logs, at most one per core."""
    verbose: bool = False
    """Print a line for every log, even if there are many."""


@dataclass(frozen=True)
class CheckOptions(Settings):
    """Test your own adapter against its port's contract, clause by clause.

    Exit code 0: every applicable clause holds; 1: a clause is violated; 2: the name is not a contract suite.
    """

    suite: Annotated[str, tyro.conf.Positional]
    """Contract suite: package.module:Name."""
    moves: bool = False
    """Send commands to the arm, some of them too fast. For simulated arms only."""


@dataclass(frozen=True)
class DoctorOptions(AcknowledgeSettings):
    """Open each device of a rig, measure its rate, age and noise, and print remedies for problems.

    Nothing moves and no servo is switched on, except with --move. First close other programs that use the devices.

    Exit code 0: no problem; 1: a problem was found; 2: the rig file or an option is invalid.
    """

    rig: str = ""
    """Rig file with the devices."""
    seconds: Annotated[float, Range(0.2, 600.0)] = 3.0
    """Measurement time for each device."""
    push: bool = False
    """Ask you to push the tool, and check the signs of the wrench."""
    move: bool = False
    """Switch on the arm, move each joint by 0.001 rad and back, starting with the last, and check that it follows."""
    arm: str = ""
    """Name of an arm whose kinematic model replaces the one in the rig file."""


@dataclass(frozen=True)
class CalibrateOptions(AcknowledgeSettings, RunSettings):
    """Measure the parameters of a new rig in steps that you confirm, and write them to the rig file.

    Nothing else in the file changes. The arm moves at up to 5 mm/s and stops when the force changes by 10 N. Every run
    on the rig uses the results.

    Exit code 0: all steps succeeded; 1: a step failed, or its data were insufficient; 2: an option or file is invalid.
    """

    rig: str = ""
    """Rig file with the devices; the results are added to it."""
    steps: tuple[str, ...] = ("payload", "plate", "hole")
    """Steps: payload (weight, centre of mass and mounting angle), plate (height and stiffness), hole (position)."""
    yes: bool = False
    """Skip the confirmations; for emulated rigs only."""


@dataclass(frozen=True)
class EmulateOptions(EmulationConfig, RunSettings):
    """Emulate the devices in a job's work cell until Ctrl-C.

    MuJoCo simulates the arm. Serial and CAN devices are on pseudo-terminals; a Net F/T and a Universal Robots
    controller are on local sockets. The cell is the same as in the first trial.

    The command prints a rig file. `palpate run --rig FILE` then controls the cell like real devices.
    """

    rig_file: str = ""
    """Path of the rig file to write; its job file is written next to it. Files from an earlier palpate emulate are
    replaced unless you edited them."""
    event: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """Fault to trigger: 12s:NAME (12 s after the arm first moves) or start+12s:NAME (12 s after the start). Names:
    protective-stop, emergency-stop, program-end, cable-pulled (arm), sensor-silent, sensor-cable. May be repeated."""
    priority: Annotated[int, Range(0, 99), RARE] = 0
    """Real-time priority (SCHED_FIFO) for the emulated devices, 1 to 99, so that other programs do not delay them. 0
    requests none. A denied request is reported."""


@dataclass(frozen=True)
class StudyOptions(Settings):
    """Run every combination of settings, policies and seeds in a TOML file, each in a separate folder.

    The file:

      [study]
      trials = 150
      seeds = [0, 1, 2]                      # or the number of seeds
      policies = ["q-learning", "torque"]    # learners are trained; baselines and policy files run as they are
      job = "my-part.toml"                   # job file, relative to this file; default: the paper's peg

      [base]                                 # settings for all conditions, as in a run.toml
      scenario = "paper"

      [grid]                                 # a list of values for each setting: all combinations
      "task.start_uncertainty_mm" = [1.0, 2.0]

    Several [[grid]] tables are run in sequence. Trials are recorded only if the file sets recording.enabled.

    Run the same command again to resume the study. Results depend neither on the number of workers nor on their order.

    Exit code 0: all conditions are finished; 1: some failed; 2: the file, the folder or an option is invalid; 130:
    ended by Ctrl-C.
    """

    file: Annotated[str, tyro.conf.Positional]
    """Study file (TOML)."""
    out: str = ""
    """Folder for the study. Default: runs/NAME-OF-THE-FILE."""
    jobs: Jobs = 0
    """Number of processes; 0 uses one per core."""
    scheduler: str = ""
    """Dask scheduler that runs the conditions: tcp:// on loopback, tls://, or local to start one with --jobs workers.
    Workers need the same palpate and the study's folder. Install Dask with: pip install 'palpate[cluster]'."""


@dataclass(frozen=True)
class ExploreOptions(Settings):
    """Train a learner to find the goal of a grid world with an ambiguous sensor, and compare it with the optimum.

    The command prints the mean number of steps in the last 100 trials of each run, and two lower bounds: the optimum
    with full information and the belief-state optimum.
    """

    map: str = "1"
    """Scenario 1, 2 or twin; eight regions such as ABC/C.E/BDF; or a text file with rows of letters, in which # is a
    wall and a dot is the goal."""
    size: int = 7
    """Side length in cells; must be odd. A text file defines its own size."""
    state: str = "symbols"
    """Learner state: symbols (the last symbol), last-2 or last-3 (the last two or three), or an automaton file
    (.json)."""
    learning: Annotated[GridLearning, tyro.conf.arg(name="")] = field(default_factory=GridLearning)
    trials: Trials = TRIALS
    """Number of trials per run."""
    seeds: Annotated[int, Range(1, 100_000)] = 3
    """Number of independent runs."""
    seed: Annotated[int, Range(0, 2**32 - 1)] = 0
    """Seed for the first run; it increases by one with each run."""
    out: str = ""
    """New or empty folder for the trials, policies, summary and learning curve."""
    figure: str = ""
    """Draw the paper's figure 3 instead, for both scenarios with symbols and with an automaton inferred from random
    walks. Takes a new .svg, .png or .pdf file."""
    strings: str = ""
    """Write the symbols from random walks to this file instead, one walk per line."""
    walks: int = 1000
    """Number of random walks, for --strings and for inference."""
    longest: int = 30
    """Maximum number of steps in a walk; longer walks are omitted."""
