"""Each path of each document that a person may write: what is wrong there is answered in one line that names it.

Every second path is tried here, the others in ``make nightly``.

At each path of a sound document a value is left out, doubled, of another type or out of range, or a key is added that
nothing knows. What the command then says is either exit code 2 with the path in one line, or that of the sound
document: the value was a default's, or anything may be there.
"""

import json
import re
import tomllib
from copy import deepcopy
from fnmatch import fnmatchcase
from pathlib import Path
from random import Random
from typing import NamedTuple

import pytest

from palpate.adapters.cli.rig_new import rig_text
from palpate.adapters.config import literal
from tests.command_line import JOB, CommandLine, shared_folder

ROOT = Path(__file__).parents[2]
NAMED = {"base": "", "grid": "", "run": "", "lear": "learner."}
"""How messages call tables that are not settings of their own."""
GONE = object()
IN_JSON = ("policy", "belief", "automaton")
RIG = f"run --rig FILE {' '.join(JOB)} --policy torque --out new"
AUTOMATON = {
    "schema": "palpate.automaton/2", "kind": "dfa", "alphabet": ["a", "b"], "start": "even",
    "states": [
        {"name": "even", "output": True, "next": {"a": "odd", "b": "even"}},
        {"name": "odd", "output": False, "next": {"a": "even", "b": None}},
    ],
}  # fmt: skip
STUDY = {
    "study": {"trials": 2, "seeds": [0, 1], "policies": ["q-learning", "torque"], "job": "job.toml"},
    "base": {"task": {"time_limit_s": 0.3}},
    "grid": [{"task.step_mm": [0.4, 0.5], "learning.gamma": [0.9]}],
}


class Document(NamedTuple):
    """A kind of document.

    Attributes:
        words: Command that reads it as ``FILE``, and refuses the sound one for another reason.
        reason: That reason.
        needed: Paths at which something must be.
        free: Paths at which a value of any size, any text, or a longer list is accepted.
        open: Paths at which anything is accepted.
        linked: Paths that others must agree with; the line may name these.
        each: Changes that are tried at a path.
    """

    words: str
    reason: str
    needed: tuple[str, ...]
    free: tuple[str, ...] = ()
    open: tuple[str, ...] = ()
    linked: tuple[str, ...] = ()
    each: int = 1


DEVICES = ("arm", "arm.adapter", "force_sensor", "force_sensor.adapter")
POLICY = Document(
    "run --policy FILE --out full", "full: already holds",
    needed=("schema", "perception*", "states*", "actions", "actions.?", "actions.?.[nd]*", "learner.kind"),
    free=("learner.parameters.initial_value", "learner.state.q*", "learner.state.trials*"),
    open=("created_with*", "perception.signal.tool"),
    linked=("perception*", "states*", "actions*", "learner.[ks]*"),
)  # fmt: skip
DOCUMENTS = {
    "job": Document(
        "train --job FILE --out full", "full: already holds",
        needed=("part", "part.peg_mm", "part.hole_mm", "part.depth_mm", "tool", "tool.tip_mm", "place", "place.x_mm"),
        linked=("arm.name",), each=2,
    ),
    "rig": Document(
        RIG, "no terminal for a", needed=DEVICES,
        free=("rig.*", "*.port", "*.interface", "*.channel", "arm.velocity_rad_s", "arm.acceleration_rad_s2"),
        linked=("arm.name", "arm.baud", "arm.*_rad_s*", "force_sensor.cutoff_Hz", "force_sensor.period_us"),
    ),
    "rig of a UR": Document(RIG, "no terminal for a", needed=DEVICES, free=("rig.*",), linked=("arm.name",)),
    "study": Document(
        "study FILE --out full", "full: holds something already", needed=(),
        free=("study.seeds*", "grid"), open=("study.seeds",), linked=("study*",), each=9,
    ),
    "policy": POLICY,
    "belief": POLICY,
    "automaton": Document(
        "infer --show FILE --out there.json", "there.json", needed=("*",), linked=("alphabet*", "states*"), each=9,
    ),
    "run": Document(
        "train --config FILE --out full", "full: already holds", needed=("run.format",),
        free=(
            "seed", "task.goal.rpy_deg*", "perception.calibration*", "perception.memory", "control.*", "run.*",
            "learning.examples", "recording.*", "supervision.weakened", "real_time.*",
        ),
        open=("run", "run.command", "run.part", "run.versions*"), linked=("task.goal*",),
    ),
}  # fmt: skip


@pytest.fixture(scope="session")
def sound(tmp_path_factory, trained):
    """A sound document of each kind."""

    def make(out):
        words = ("--learner", "belief", "--trials", 1, "--task.time-limit-s", 0.5, "--recording.no-enabled")
        CommandLine().succeed("train", *words, "--out", out)

    belief = shared_folder(tmp_path_factory, "belief", make)
    ur = rig_text("ur-rtde", "ati-netft", "ur5e").replace("# host = ...", 'host = "10.0.0.2"')
    return {
        "job": tomllib.loads((ROOT / "examples" / "jobs" / "square-20.toml").read_text()),
        "rig": tomllib.loads(rig_text("zebra-nmc", "jr3-can", "zebra-zero")),
        "rig of a UR": tomllib.loads(ur),
        "study": STUDY,
        "policy": json.loads((trained / "policy.json").read_text()),
        "belief": json.loads((belief / "policy.json").read_text()),
        "automaton": AUTOMATON,
        "run": tomllib.loads((trained / "run.toml").read_text()),
    }


@pytest.fixture
def desk(palpate):
    """The command line in a folder where every document but for the changed one is sound."""
    for name in ("full/run.toml", "there.json", "job.toml"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_bytes(
            (ROOT / "examples" / "jobs" / "paper-peg.toml").read_bytes() if name == "job.toml" else b""
        )
    return palpate


def places(value, rng, path=()):
    """Yield every path with what is there; of a list one item."""
    if path:
        yield path, value
    inner = value if isinstance(value, dict) else {}
    if isinstance(value, list) and value:
        number = rng.randrange(len(value))
        inner = {number: value[number]}
    for key, each in inner.items():
        yield from places(each, rng, (*path, key))


def changes(value):
    """Yield what may go wrong with a value, and the value then."""
    yield "missing", GONE
    if isinstance(value, bool):
        yield "type", "yes"
    elif isinstance(value, (int, float)):
        yield "type", "many"
        yield from (("range", sign * (10**15 if isinstance(value, int) else 1e300)) for sign in (-1, 1))
    elif isinstance(value, str):
        yield from (("type", 3), ("range", "no such \x01"))
    elif isinstance(value, list):
        yield from (("type", 3), ("range", []), ("double", value * 2))
    elif isinstance(value, dict):
        yield from (("type", 3), ("unknown", {**value, "no_such": 1}))


def changed(document, path, value):
    """Return the document with another value at a path."""
    copy = deepcopy(document)
    table = copy
    for key in path[:-1]:
        table = table[key]
    if value is GONE:
        del table[path[-1]]
    else:
        table[path[-1]] = value
    return copy


def text_of(document, name):
    """The text of a document, JSON or TOML."""
    if name in IN_JSON:
        return json.dumps(document)
    return "".join(f"{literal(name)} = {literal(value)}\n" for name, value in document.items())


def shown(path):
    """A path as messages name it."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).lstrip(".")
    # Settings are named as flags and run.toml name them, wherever a file has them.
    return re.sub(r"^(base|grid\[\d+\]|learner\.state|run)\.(?=[a-z])", lambda found: NAMED[found[1][:4]], text)


def complaint(kind, document, what, path, done):
    """What is wrong with the answer; empty for nothing."""
    name, line = ".".join(map(str, path)), done.stderr

    def among(*patterns):
        return any(fnmatchcase(name, pattern) for pattern in patterns)

    if (done.code, line[:9], done.stdout) != (2, "palpate: ", ""):
        return f"{what} at {name}: {done}"
    if kind.reason in line:
        may_be = not among(*kind.needed) if what == "missing" else what in ("range", "double") and among(*kind.free)
        return "" if may_be or among(*kind.open) else f"{what} at {name} is accepted"
    if line.count("\n") != 1:
        return f"{what} at {name}: {line}"
    named = [re.sub(r"(\[\d+\])+$", "", shown(path))]
    if what == "unknown":
        named = ["no_such"]
    elif what in ("missing", "double") or among(*kind.linked):
        named = [*document, *(str(key) for key in path)]
    return "" if any(each in line for each in named) else f"{what} at {name}, which is not named: {line}"


@pytest.mark.parametrize("half", [0, pytest.param(1, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("name", DOCUMENTS)
def test_what_is_wrong_in_a_document_is_refused_in_one_line_with_its_path(desk, sound, name, half):
    kind, document, rng = DOCUMENTS[name], sound[name], Random(name)
    words = kind.words.replace("FILE", "document").split()
    Path("document").write_text(text_of(document, name))
    assert kind.reason in desk(*words).stderr
    complaints, tried = list[str](), 0
    tables = ((path, list(changes(value))) for path, value in places(document, rng))
    drawn = [(path, rng.sample(possible, min(kind.each, len(possible)))) for path, possible in tables]
    for path, chosen in drawn[half::2]:
        for what, other in chosen:
            Path("document").write_text(text_of(changed(document, path, other), name))
            complaints += filter(None, [complaint(kind, document, what, path, desk(*words))])
            tried += 1
    assert not complaints, "\n".join(complaints)
    assert tried > 10


@pytest.mark.parametrize("name", DOCUMENTS)
def test_byte_order_mark_is_skipped_and_half_a_document_or_a_key_given_twice_refused(desk, sound, name):
    kind, document = DOCUMENTS[name], sound[name]
    text = text_of(document, name)
    # As editors on Windows write it.
    Path("document").write_text(f"\ufeff{text}")
    assert kind.reason in desk(*kind.words.replace("FILE", "document").split()).stderr
    twice = text.replace("{", '{"schema": "twice", ', 1) if name in IN_JSON else text + text.splitlines()[0]
    for broken in (text[: len(text) // 2], twice):
        Path("document").write_text(broken)
        desk.refusal(*kind.words.replace("FILE", "document").split())
