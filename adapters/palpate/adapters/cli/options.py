"""Command-line options of the commands that load the simulator.

Nothing here loads it, so that ``--help`` and wrong words are answered at once. Options of other commands are next to
these.
"""

from copy import copy
from dataclasses import dataclass, field
from typing import Annotated, Self, TypeAlias

import tyro

from palpate.adapters.config import LEARNERS, SCENARIOS, TRIALS, EmulationConfig, GridLearning, RunConfig
from palpate.core.ports import OneOf, Range, Settings

Trials: TypeAlias = Annotated[int, Range(1, 1_000_000)]
Jobs: TypeAlias = Annotated[int, Range(0, 1024)]


@dataclass(frozen=True)
class RunSettings(Settings):
    """What every command takes that runs trials.

    Attributes:
        run: The configuration that follows from files, presets and flags.
    """

    job: str = ""
    """Job file: part, tool, arm, place and limits; all other settings follow. Without one: the paper's peg."""
    scenario: Annotated[str, OneOf("", *SCENARIOS)] = ""
    """Conditions of the simulated trials: job, paper, blind, or blind with one condition more, such as blind-tilt-4.
    If not given: job with --job, else paper."""
    task: str = ""
    """Task: insertion, insertion-6dof, or one of another package. If not given: insertion."""
    arm: str = ""
    """Arm by name, such as ur5e; one of your own is a table [arm] in the job."""
    learner: Annotated[str, OneOf("", *LEARNERS)] = ""
    """What learns. If not given: what trained the policy file, else q-learning."""
    seed: Annotated[int, Range(-1, 2**63 - 1, text=f"a whole number from 0 to {2**63 - 1}")] = -1
    """Every random stream of every trial follows from it. If not given: 0."""
    config: str = ""
    """TOML file with settings, such as a run.toml; it wins over the job, and flags over it."""
    run: RunConfig = field(default_factory=RunConfig, init=False)

    def with_run(self, run: RunConfig) -> Self:
        """Return the same options with another configuration."""
        other = copy(self)
        object.__setattr__(other, "run", run)
        return other


@dataclass(frozen=True, kw_only=True)
class LiveSettings(Settings):
    """What every command takes that can be watched."""

    live: bool = False
    """Show trials in Rerun while they run: pip install 'palpate[rerun]'. Each tick then takes longer."""
    live_port: Annotated[int, Range(0, 65535)] = 0
    """Port of this computer at which the viewer connects; 0 for Rerun's usual one, 9876."""


@dataclass(frozen=True, kw_only=True)
class AcknowledgeSettings(Settings):
    """Options of every command that moves a rig."""

    accept_kinematics: bool = False
    """Move an arm by its nominal model, which is up to 10 mm off where the arm now is. Its own calibration in the rig
    file makes this needless."""

    acknowledge: str = ""
    """Let a rig move after a fault: "NUMBER NAME: why", with the number of the fault, your name and why it is safe.
    Clears that fault only, once, and not while a device still reports it."""


@dataclass(frozen=True, kw_only=True)
class MotionSettings(AcknowledgeSettings):
    """Options of the commands that run trials on a rig."""

    rig: str = ""
    """Rig file: its devices instead of the simulator."""
    confirm: str = ""
    """With --rig and without a terminal: the name of the rig, so that its arm may move. At a terminal a person is
    asked once; an emulated rig needs neither."""


@dataclass(frozen=True)
class TrainOptions(MotionSettings, LiveSettings, RunSettings):
    """Learn an insertion from scratch, and leave a folder with everything about it."""

    trials: Trials = 350
    """Number of trials."""
    out: str = ""
    """Folder for the results; runs/SCENARIO if not given. It must not hold a run already."""
    policy: str = "q-learning"
    """q-learning, for what --learner names from scratch; a policy file to go on learning from (exploration begins
    again); or a learner of another package's, package.module:Name or the name of its entry point."""
    resume: bool = False
    """Resume the run in --out where it stopped, with its settings and the same random streams."""
    from_logs: tuple[str, ...] = ()
    """Run no trials; fit the learner belief to recorded trials of any policy, with the settings of the first log. Logs,
    folders with logs, or patterns in quotes, the newest last."""


@dataclass(frozen=True)
class RunOptions(MotionSettings, LiveSettings, RunSettings):
    """Run a trained policy, or a baseline, without learning."""

    policy: str = ""
    """A policy file; oracle, torque, spiral-10, spiral-5, random; or a policy of a third-party package,
    package.module:Name or the name of its entry point."""
    trials: Trials = 50
    """Number of trials."""
    dry: bool = False
    """With --rig: read, decide and log, and send the arm no command; each trial ends soon after the tare."""
    out: str = ""
    """Folder for the results; runs/SCENARIO-run-001 or the next number if not given. It must not hold a run yet."""
    claim: str = ""
    """Claim about the policy, "success >= 0.99": the exact 95 % interval proves or refutes it, or is inconclusive.
    Exit code 0 then means proved."""
    jobs: Jobs = 1
    """Processes in the simulator; 0 takes one per core. With more than one, every 10 trials use a new policy object."""
    view: bool = False
    """Show the simulator in MuJoCo's viewer, in real time; closing the window ends the run."""


@dataclass(frozen=True)
class CompareOptions(RunSettings):
    """Compare hand-written strategies and trained policies on the same trials."""

    policy: tuple[str, ...] = ()
    """Policy files, or package.module:Name, to compare with the baselines."""
    trials: Trials = 50
    """Trials of each."""
    out: str = ""
    """Folder for the table; runs/SCENARIO-compare if not given. It must not hold a run already."""


@dataclass(frozen=True)
class PlanOptions(Settings):
    """Print what follows from a job, whether it is feasible, and which task and policy suit it best. Nothing moves.

    With --trials it also simulates the job, each trial in another cell: hole anywhere in its circle, plate height, tilt
    (from 0), friction (from 0.1 to the highest), noise (0.8 to 1.25) and stiffness (0.9 to 1.1) evenly from their
    ranges, headings and yaw too. Every 10 trials begin with a new policy object; the first of a learner's 10 is its
    training and does not count.

    Exit code 0: feasible; 1: not; 2: the job or an option cannot be used.
    """

    job: Annotated[str, tyro.conf.Positional]
    """Job file: part, tool, arm, place and limits."""
    task: Annotated[str, OneOf("", "insertion", "insertion-6dof")] = ""
    """Task: insertion or insertion-6dof; the better one if not given."""
    arm: str = ""
    """Arm instead of the job's, by name."""
    trials: Annotated[int, Range(0, 1_000_000)] = 0
    """Number of simulated trials; 0 simulates none."""
    jobs: Jobs = 1
    """Processes; 0 takes one per core. The result does not depend on it."""
    seed: Annotated[int, Range(0, 2**63 - 1)] = 0
    """Every random stream of the simulated trials follows from it."""
    out: str = ""
    """File for the picture of the trials; JOB-plan.png if not given. It must not exist yet."""


@dataclass(frozen=True)
class ReplayOptions(Settings):
    """Feed recorded trials back through the core and compare every command and decision, bit by bit.

    Exit code 0: all equal; 1: something differs; 2: a log or an option cannot be used. With --policy or --set it is
    a what-if: 1 then says that the trial would have gone otherwise, and all that follows the first other command
    is marked counterfactual.
    """

    logs: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Logs, folders with logs in or below them, or patterns in quotes."""
    policy: str = ""
    """What if: another policy; a policy file, oracle, torque, spiral-10, spiral-5, random, or
    package.module:Name."""
    set: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """What if: a setting, as in --set task.max_force_N=20; may be given several times."""
    continue_in_mujoco: bool = False
    """What if: let the simulator go on from the first other command (for logs that came from it)."""
    out: str = ""
    """Folder for the logs of a what-if; it must not be there yet."""
    strict: bool = False
    """Let a log from another processor fail when its last bits differ."""
    jobs: Jobs = 0
    """Processes; 0 takes at most one per core, and one for every thirty logs: their start takes as long as these."""
    verbose: bool = False
    """A line for every log, also where there are many."""


@dataclass(frozen=True)
class CheckOptions(Settings):
    """Try the contract of a port on an adapter of your own, clause by clause.

    Exit code 0: every clause that applies is kept; 1: one is broken; 2: the name leads to nothing that can be tried.
    """

    suite: Annotated[str, tyro.conf.Positional]
    """Contract suite, package.module:Name."""
    moves: bool = False
    """Send commands to the arm, too fast ones among them: for a simulated arm."""


@dataclass(frozen=True)
class DoctorOptions(AcknowledgeSettings):
    """Open each device of a rig, measure rate, age and noise, and say what to do about what is wrong.

    Nothing moves and no servo is switched on, except with --move. End other programs that use the devices first.

    Exit code 0: all well; 1: something is wrong; 2: the rig file or an option cannot be used.
    """

    rig: str = ""
    """Rig file: names the devices."""
    seconds: Annotated[float, Range(0.2, 600.0)] = 3.0
    """How long to measure at each device."""
    push: bool = False
    """Ask a person to push the tool, and check the signs of the wrench."""
    move: bool = False
    """Switch the arm on, move each joint by 0.001 rad and back, the last one first, and check that it follows."""
    arm: str = ""
    """Kinematic model of the arm instead of the rig file's; names as palpate run takes them."""


@dataclass(frozen=True)
class CalibrateOptions(AcknowledgeSettings, RunSettings):
    """Measure what a new rig lacks, in steps that a person confirms, and write it into the rig file.

    Nothing else in the file changes. The arm moves at 5 mm/s at most, and stops where the force changes by 10 N. Every
    run on the rig uses what was found.

    Exit code 0: all done; 1: a step failed, or its data do not determine what is asked; 2: a wrong option or file.
    """

    rig: str = ""
    """Rig file: names the devices, and takes the results."""
    steps: tuple[str, ...] = ("payload", "plate", "hole")
    """payload: weight, centre of mass and mounting angle; plate: height and stiffness; hole: its place."""
    yes: bool = False
    """Do not ask; for emulated rigs only."""


@dataclass(frozen=True)
class EmulateOptions(EmulationConfig, RunSettings):
    """Serve the cell of a job behind emulated wires, until Ctrl-C.

    MuJoCo moves the arm; pseudo-terminals lead to its devices, sockets of this computer to a Net F/T and to a
    controller of Universal Robots. The cell is that of the first trial.

    Prints a rig file; `palpate run --rig FILE` then drives the cell as it would drive the devices themselves.
    """

    rig_file: str = ""
    """Write the rig file here, and its job next to it; files that palpate emulate wrote are replaced unless changed."""
    event: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """Rehearse a fault: 12s:protective-stop, 12 s after the arm first moves; start+12s:NAME, 12 s after the start.
    Others: emergency-stop, program-end, cable-pulled (arm), sensor-silent, sensor-cable. May be given several times."""
    priority: Annotated[int, Range(0, 99)] = 0
    """Real-time priority (SCHED_FIFO) of the emulated devices, 1 to 99: other work on this machine then does not hold
    them up, which real devices would not know either. 0 requests none; a refusal is reported."""


@dataclass(frozen=True)
class StudyOptions(Settings):
    """Run every combination of settings, policies and seeds of a TOML file, each in a folder of its own.

    The file:

      [study]
      trials = 150
      seeds = [0, 1, 2]                      # or their number
      policies = ["q-learning", "torque"]    # learners are trained; baselines and policy files run as they are
      job = "my-part.toml"                   # job file, from the folder of this file; without it the paper's peg

      [base]                                 # settings of all conditions, as in a run.toml
      scenario = "paper"

      [grid]                                 # a list of values for each setting: all combinations
      "task.start_uncertainty_mm" = [1.0, 2.0]

    Several [[grid]] tables are run one after the other. Trials are not recorded unless the file sets recording.enabled.

    The same command continues where it stopped. Results depend neither on the number of workers nor on their order.

    Exit code 0: all conditions are finished; 1: some failed; 2: the file, the folder or an option cannot be used; 130:
    ended by Ctrl-C.
    """

    file: Annotated[str, tyro.conf.Positional]
    """The study file (TOML)."""
    out: str = ""
    """Folder for the study; runs/NAME-OF-THE-FILE if not given."""
    jobs: Jobs = 0
    """Processes; 0 takes one per core."""
    scheduler: str = ""
    """Dask scheduler that runs the conditions: tcp:// on loopback, tls://, or local to start one with --jobs workers.
    Workers need this palpate and the folder of the study: pip install 'palpate[cluster]'."""


@dataclass(frozen=True)
class ExploreOptions(Settings):
    """Learn to find the goal of a grid world with an ambiguous sensor, and compare with the optimum.

    Prints, for each run, the mean number of steps in its last 100 trials, and what is possible at all: the
    optimum with full information and the belief-state optimum.
    """

    map: str = "1"
    """1, 2 or twin: the scenarios; eight regions such as ABC/C.E/BDF; or a text file with rows of letters, # for a
    wall and a dot for the goal."""
    size: int = 7
    """Length of a side in cells, odd; a text file has its own."""
    state: str = "symbols"
    """symbols: a state is a symbol; last-2, last-3: the last symbols; or an automaton file (.json)."""
    learning: Annotated[GridLearning, tyro.conf.arg(name="")] = field(default_factory=GridLearning)
    trials: Trials = TRIALS
    """Trials of each run."""
    seeds: Annotated[int, Range(1, 100_000)] = 3
    """Number of independent runs."""
    seed: Annotated[int, Range(0, 2**32 - 1)] = 0
    """Seed of the first; the others follow."""
    out: str = ""
    """Folder for every trial, the policies, summary and learning curve; it must not be there yet, or be empty."""
    figure: str = ""
    """Instead: draw the paper's figure 3, both scenarios with symbols and with an automaton from random walks; a file,
    .svg, .png or .pdf."""
    strings: str = ""
    """Instead: write the symbols of random walks to this file, one walk a line."""
    walks: int = 1000
    """Number of random walks, for --strings and for inference."""
    longest: int = 30
    """Walks with more steps are left out."""
