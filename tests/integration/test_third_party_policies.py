"""A stranger's package of policies: trained, run, recorded, and replayed with its code and without it."""

import importlib
import struct
import sys
from base64 import b64decode
from pathlib import Path

import pytest

from palpate.adapters.contracts import CONTEXT, LearnerContract, third_party
from palpate.adapters.experiments import load_policy
from palpate.adapters.log import read_log
from palpate.adapters.replay.batch import replay_file
from palpate.adapters.replay.engine import Verdict
from palpate.adapters.replay.rebuild import Rebuilder
from tests.command_line import CommandLine, shared_folder
from tests.support.log_surgery import changed, indices, messages_of, one_ulp, write_log

PACKAGE = Path(__file__).parents[2] / "examples" / "third_party_policies"
DRIFT = "third_party_policies.drift:Drift"


def forget():
    for name in [name for name in sys.modules if name.startswith(("third_party_policies", "badly_made", "ill_made"))]:
        del sys.modules[name]
    importlib.invalidate_caches()


@pytest.fixture(autouse=True)
def forgetful():
    """No test finds modules that one before has left, or leaves some behind."""
    forget()
    yield
    forget()


@pytest.fixture
def installed(monkeypatch):
    """The package can be imported, as one that pip has installed can."""
    monkeypatch.syspath_prepend(str(PACKAGE))


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A training of two trials by the stranger's learner."""

    def make(out):
        with pytest.MonkeyPatch.context() as patched:
            patched.syspath_prepend(str(PACKAGE))
            CommandLine().succeed("train", "--policy", DRIFT, "--trials", 2, "--out", out)
        forget()

    return shared_folder(tmp_path_factory, "strange", make)


@pytest.mark.usefixtures("installed")
class TestTable(LearnerContract):
    def make(self, *, frozen=False):
        return third_party(importlib.import_module("third_party_policies.table").Table(CONTEXT), frozen=frozen)


def replayed(messages, folder):
    path = folder / "changed.mcap"
    path.unlink(missing_ok=True)
    return replay_file(write_log(path, messages), Rebuilder())


@pytest.mark.usefixtures("installed")
def test_it_is_trained_run_shown_and_reported(palpate, trained):
    document = load_policy(trained / "policy.json")
    assert document.third_party.trials_learned == 2
    assert document.third_party.state["holes"] == 2
    assert f"made by {DRIFT}, trained on 2 trials" in palpate.succeed("show", trained / "policy.json")
    palpate.succeed("run", "--policy", trained / "policy.json", "--trials", 1, "--out", "learned")
    start = read_log("learned/logs/trial-00000.mcap").start
    assert (start.policy, start.frozen) == (DRIFT, True)
    assert '"holes":2' in start.learner_json.replace(" ", "")
    assert DRIFT in palpate.succeed("log", "info", "learned/logs/trial-00000.mcap")
    palpate.succeed("report", "learned")
    palpate.succeed("train", "--policy", DRIFT, "--trials", 1, "--out", "resumed")
    palpate.succeed("train", "--resume", "--out", "resumed", "--trials", 2)
    learned = [load_policy(folder / "policy.json").third_party for folder in (Path("resumed"), trained)]
    assert learned[0] == learned[1]


def test_trials_replay_with_its_code_and_without_it(palpate, trained, monkeypatch):
    without = palpate.succeed("replay", trained)
    assert "2 of 2 equal in every bit" in without
    assert "of 2 of them the decisions come from the log" in without
    assert "No module named 'third_party_policies'" in without
    assert "install what made it" in palpate("replay", trained, "--set", "task.max_force_N=20").stdout
    refused = palpate.refusal("run", "--policy", trained / "policy.json", "--out", "run")
    assert "No module named 'third_party_policies'" in refused
    monkeypatch.syspath_prepend(str(PACKAGE))
    with_code = palpate.succeed("replay", trained)
    assert "2 of 2 equal in every bit" in with_code
    assert "taken from the log" not in with_code


def turned(values, place):
    """One of the bits in the middle of a number; the last ones of a sample may be lost in rounding."""
    (bits,) = struct.unpack("<q", struct.pack("<d", values[place]))
    (values[place],) = struct.unpack("<d", struct.pack("<q", bits ^ 1 << 30))


ALTERED = [
    ("/tick", lambda made: one_ulp("requested_rad", 2)(made)),
    ("/tick", lambda made: turned(made.wrench.force_N, 2)),
    ("/decision", lambda made: setattr(made, "source", "drifu")),
    ("/end", one_ulp("depth_m")),
]
"""A bit of a message of this channel is turned over."""


def test_one_changed_bit_is_found_without_its_code(trained, tmp_path):
    messages = messages_of(trained / "logs" / "trial-00000.mcap")
    same = replayed(messages, tmp_path)
    assert (same.verdict, bool(same.recorded_decisions)) == (Verdict.EQUAL, True)
    for topic, change in ALTERED:
        places = indices(messages, topic)
        altered = changed(messages, places[len(places) // 2], change)
        assert replayed(altered, tmp_path).verdict is not Verdict.EQUAL, topic

    def elsewhere(made):
        made.policy_json = made.policy_json.replace("Drift", "Drifs")

    assert replayed(changed(messages, 0, elsewhere), tmp_path).verdict is Verdict.REFUSED
    learned = changed(messages, 0, lambda made: setattr(made, "learner_json", made.learner_json.replace("0.0", "0.5")))
    assert replayed(learned, tmp_path).verdict is Verdict.DIVERGED


BAD = """
import os
from palpate.core.policy import Action, Decision, FixedPolicy

class Bad(FixedPolicy):
    def choose(self, observation):
        if observation.action_number == 1:
            {does}
        return Decision(Action("own", (1e-4, 0.0)), None, "bad")

class Wanderer(Bad):
    def __init__(self):
        os.chdir("/")

    begin_trial = learn = lambda self, *_: os.chdir("/")

class Unfinished(Bad):
    choose = None

class Stillborn(Bad):
    def __init__(self):
        raise OSError("no weights")
"""


def test_one_that_fails_in_a_trial_stops_the_arm_and_leaves_a_log_that_says_whose_fault_it_was(palpate, monkeypatch):
    monkeypatch.syspath_prepend(str(Path.cwd()))
    Path("badly_made.py").write_text(BAD.format(does="raise ZeroDivisionError('oh')"))
    words = ("run", "--policy", "badly_made:Bad", "--cell.hole-uncertainty-mm", 3, "--seed", 3, "--out")
    traced = palpate(*words, "traced", "--debug").stderr
    assert "Traceback" in traced
    assert "raise ZeroDivisionError('oh')" in traced
    done = palpate(*words, "bad")
    said = done.stderr.strip().splitlines()[-1]
    assert said.startswith("palpate: policy badly_made:Bad: choose failed with ZeroDivisionError: oh (badly_made.py:8)")
    assert done.code == 1
    assert "Traceback" not in done.stderr
    path = Path("bad/logs/trial-00000.mcap")
    log = read_log(path)
    assert (log.end.error, log.end.raised_by, log.calls[-1].call) == ("PolicyError", "policy", "stop")
    assert replay_file(path, Rebuilder()).verdict is Verdict.EQUAL
    Path("badly_made.py").unlink()
    forget()
    alone = replay_file(path, Rebuilder())
    assert (alone.verdict, "ended by PolicyError" in alone.note) == (Verdict.EQUAL, True)


def test_one_that_changes_the_working_folder_moves_no_result(palpate, monkeypatch):
    monkeypatch.syspath_prepend(str(Path.cwd()))
    Path("badly_made.py").write_text(BAD.format(does="pass"))
    quick = ("--policy", "badly_made:Wanderer", "--task.time-limit-s", 0.5)
    palpate.succeed("run", *quick, "--trials", 2, "--out", "run")
    assert Path("run/trials.csv").is_file()
    logs = sorted(Path("run/logs").iterdir())
    printed = palpate.succeed("replay", *logs, "--jobs", 1)
    assert "2 of 2 equal in every bit" in printed


def test_one_that_cannot_even_begin_is_refused_before_a_folder_is_made(palpate, monkeypatch):
    monkeypatch.syspath_prepend(str(Path.cwd()))
    Path("ill_made.py").write_text(BAD.format(does="pass"))
    Path("broken.py").write_text("1 / 0\n")
    Path("leaving.py").write_text("raise GeneratorExit\n")
    for name, reason in (
        ("nowhere:Bad", "No module named 'nowhere'"),
        ("broken:Bad", "imports without failing (ZeroDivisionError"),
        ("leaving:Bad", "imports without failing (GeneratorExit"),
        ("ill_made:Good", "a name in ill_made; it has no Good"),
        ("ill_made:Unfinished", "its Unfinished lacks choose"),
        ("ill_made:Stillborn", "no policy can be made: OSError: no weights"),
        ("ill_made:__doc__", "a class or a function that makes a policy"),
        ("drift", "a policy file, or one of oracle"),
    ):
        assert reason in palpate.refusal("run", "--policy", name, "--out", "run")
    assert "by get_state and set_state" in palpate.refusal("train", "--policy", "ill_made:Bad", "--out", "run")


RUN_NETWORK = (
    "run", "--policy", "third_party_policies.network:Network", "--trials", 1, "--task.time-limit-s", 1,
    "--cell.hole-uncertainty-mm", 3, "--seed", 3, "--out", "net",
)  # fmt: skip


@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
@pytest.mark.nightly
def test_a_network_of_torchscript_is_run_and_replayed(palpate, monkeypatch, tmp_path):
    torch = importlib.import_module("torch")
    layer = torch.nn.Linear(12, 8)
    with torch.no_grad():
        layer.weight.copy_(torch.linspace(-1.0, 1.0, 96).reshape(8, 12))
    torch.jit.trace(layer, torch.zeros(12), check_trace=False).save(str(tmp_path / "net.pt"))
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.setenv("POLICY_NETWORK", str(tmp_path / "net.pt"))
    palpate.succeed(*RUN_NETWORK)
    assert "1 of 1 equal in every bit" in palpate.succeed("replay", "net")
    with torch.no_grad():
        layer.bias.add_(1.0)
    torch.jit.trace(layer, torch.zeros(12), check_trace=False).save(str(tmp_path / "net.pt"))
    assert "another network than the one of this log" in palpate("replay", "net").stdout


ONNX = (
    "CAg67wMKHgoEZmVsdAoGbWF0cml4EgZ2YWx1ZXMiBk1hdE11bBIHbmV0d29yayqRAwgMCAgQAUIGbWF0cml4SoAD",
    "WhYKBGZlbHQSDgoMCAESCAoCCAEKAggMYhgKBnZhbHVlcxIOCgwIARIICgIIAQoCCAhCAhAN",
)
"""A network of twelve inputs and eight outputs in ONNX: a product with a matrix, whose weights stand between these."""


@pytest.fixture
def onnx_network(monkeypatch, tmp_path):
    before, after = map(b64decode, ONNX)
    weights = struct.pack("<96f", *(k / 96 - 0.5 for k in range(96)))
    (tmp_path / "net.onnx").write_bytes(before + weights + after)
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.setenv("POLICY_NETWORK", str(tmp_path / "net.onnx"))


@pytest.mark.usefixtures("onnx_network")
def test_a_network_of_onnx_is_run_and_replayed(palpate):
    pytest.importorskip("onnxruntime")
    palpate.succeed(*RUN_NETWORK)
    assert "1 of 1 equal in every bit" in palpate.succeed("replay", "net")


@pytest.mark.usefixtures("onnx_network")
def test_without_onnxruntime_a_line_says_what_to_install(palpate, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    assert "net.onnx needs onnxruntime: pip install onnxruntime" in palpate.refusal(*RUN_NETWORK)
