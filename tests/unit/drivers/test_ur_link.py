"""The link to the client of Universal Robots, and the client's process as a thread over a client that is scripted."""

import json
import signal
import socket
import sys
import threading
from types import ModuleType, SimpleNamespace

import pytest

from palpate.drivers.errors import SettingError, SilentError, WiringError
from palpate.drivers.ur import UrLink, process_main
from palpate.drivers.ur import link as link_module
from palpate.drivers.ur.process_main import Served
from tests.wall_clock.late import wait_for

POSE = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
LIMIT_S = 20.0


class Client:
    """All three interfaces of ur_rtde: answers what it is set to, and notes what it is called for."""

    def __init__(self, *arguments):
        self.calls = []
        self.answers = {
            "polyscopeVersion": "5.11", "getSerialNumber": "2020", "isInRemoteControl": True, "isConnected": True,
            "getActualQ": POSE, "getFtRawWrench": (0.0, 0.0, -5.0, 0.0, 0.0, 0.0), "getRobotMode": 7,
            "getSafetyMode": 1, "getRuntimeState": 2, "getPayload": 0.5, "getPayloadCog": (0.0, 0.0, 0.1),
            "getActualTCPPose": POSE, "getTCPOffset": (0.0, 0.0, 0.2, 0.0, 0.0, 0.0), "isProgramRunning": True,
            "getTimestamp": 3.0,
        }  # fmt: skip

    def __getattr__(self, name):
        def call(*arguments):
            self.calls.append((name, *arguments))
            answer = self.answers.get(name, True)
            if isinstance(answer, Exception):
                raise answer
            return answer() if callable(answer) else answer

        return call

    def called(self, *names):
        return [call for call in list(self.calls) if call[0] in names]


@pytest.fixture
def client(monkeypatch):
    made = Client()
    kinds = {"dashboard_client": "Dashboard", "rtde_receive": "RTDEReceive", "rtde_control": "RTDEControl"}
    for name, kind in kinds.items():
        module = ModuleType(name)
        suffix = "Client" if kind == "Dashboard" else "Interface"
        setattr(module, kind + suffix, lambda *arguments: made)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr("palpate.drivers.ur.link.find_spec", lambda name: True)
    monkeypatch.setattr(process_main.os, "_exit", lambda code: None)
    return made


@pytest.fixture
def link(client, monkeypatch):
    class InThread(UrLink):
        """Its process is a thread."""

        def _start(self, fd):
            with socket.socket(fileno=fd) as line:
                own = line.dup().detach()
                line.detach()
            monkeypatch.setattr(sys, "argv", ["process", str(own), *self._words])
            self.thread = threading.Thread(target=process_main.main)
            self.thread.start()

    made = InThread("arm", 500.0, real_time_factor=0.5)
    yield made
    made.close()
    made.thread.join(LIMIT_S)


def test_link_leads_the_client_and_shows_its_state(link, client):
    hello = link.open(LIMIT_S)
    assert (hello.version, hello.serial) == ("5.11", "2020")
    state = wait_for(link.state)
    assert (state.q_rad, state.timestamp_s, state.robot_mode, state.payload_kg) == (POSE, 3.0, 7, 0.5)
    assert 0 <= link.stamp_ns() - state.stamp_ns < LIMIT_S * 1e9
    assert link.call("remote", LIMIT_S) is True
    assert link.call("control", LIMIT_S, 0.0)
    assert link.call("tcp", LIMIT_S) == [0.0, 0.0, 0.2, 0.0, 0.0, 0.0]
    assert not client.called("setWatchdog", "reuploadScript")
    # The second program is the first one sent again.
    assert link.call("control", LIMIT_S, 6.0)
    assert client.called("setWatchdog", "reuploadScript") == [("reuploadScript",), ("setWatchdog", 6.0)]
    link.servo(POSE, 0.007, 0.03, 1000.0)
    assert wait_for(lambda: client.called("servoJ")) == [("servoJ", list(POSE), 0.5, 0.5, 0.007, 0.03, 1000.0)]
    assert link.call("unlock", LIMIT_S) is None
    assert client.called("closeSafetyPopup", "unlockProtectiveStop")
    link.close()
    link.thread.join(LIMIT_S)
    assert client.called("servoStop", "stopScript") == [("servoStop", 20.0), ("stopScript",)]


def test_stopped_program_is_not_stopped_again_at_the_end(link, client):
    client.answers["getSerialNumber"] = RuntimeError("unknown command")
    assert link.open(LIMIT_S).serial == ""
    assert link.call("stop", LIMIT_S, 15.0)
    link.call("control", LIMIT_S, 0.0)
    link.servo(POSE, 0.007, 0.03, 1000.0)
    wait_for(lambda: client.called("servoJ"))
    assert link.call("stop", LIMIT_S, 15.0)
    link.close()
    link.thread.join(LIMIT_S)
    assert client.called("servoStop", "stopScript") == [("servoStop", 15.0), ("stopScript",)]


@pytest.mark.parametrize(("error", "said"), [(RuntimeError(" no dashboard "), "no dashboard"), (OSError(), "OSError")])
def test_refused_request_is_named_and_the_link_stays(link, client, error, said):
    link.open(LIMIT_S)
    client.answers["isInRemoteControl"] = error
    with pytest.raises(WiringError, match=rf"arm \(remote\): {said}"):
        link.call("remote", LIMIT_S)
    client.answers["isInRemoteControl"] = False
    assert link.call("remote", LIMIT_S) is False


def test_program_that_does_not_start_is_named(link, client, monkeypatch):
    link.open(LIMIT_S)
    link.call("control", LIMIT_S, 0.0)
    monkeypatch.setattr(process_main, "_START_S", 0.01)
    client.answers["isProgramRunning"] = False
    with pytest.raises(WiringError, match="the control program does not start"):
        link.call("control", LIMIT_S, 0.0)


def test_lost_controller_is_named_and_a_closed_link_is_refused(link, client):
    link.open(LIMIT_S)
    client.answers["isConnected"] = False
    with pytest.raises(SilentError, match="connection to arm is broken: the controller has closed the RTDE"):
        wait_for(lambda: link.state() and None)
    link.thread.join(LIMIT_S)
    with pytest.raises(SilentError, match="is broken: the controller has closed"):
        link.servo(POSE, 0.007, 0.03, 1000.0)
    link.close()
    with pytest.raises(SilentError, match="the connection to arm is closed"):
        link.state()


@pytest.fixture
def go():
    """What a client waits for that hangs."""
    event = threading.Event()
    yield event
    event.set()


def test_client_that_hangs_takes_no_set_points(link, client, go):
    link.open(LIMIT_S)
    client.answers["isConnected"] = lambda: go.wait(LIMIT_S)
    with pytest.raises(SilentError, match="the client takes no set-points: arm does not answer it"):
        wait_for(lambda: link.servo(POSE, 0.007, 0.03, 1000.0))
    go.set()


def test_client_that_does_not_answer_is_left(link, client, go):
    link.open(LIMIT_S)
    client.answers["isInRemoteControl"] = lambda: go.wait(LIMIT_S)
    with pytest.raises(SilentError, match=r"arm has not answered within 0\.05 s \(remote\)"):
        link.call("remote", 0.05)
    with pytest.raises(SilentError, match="is closed"):
        link.call("remote", 0.05)
    go.set()


@pytest.mark.parametrize(("printed", "said"), [(b"trace\n no route \n", "no route"), (b"", "process has ended")])
def test_client_that_dies_is_named_with_its_last_words(client, printed, said):
    class Dying(UrLink):
        def _start(self, fd):
            self._errors.write(printed)

    dying = Dying("arm", 500.0)
    with pytest.raises(SilentError, match=said):
        dying.open(LIMIT_S)
    dying.close()


def test_process_that_ignores_its_end_is_killed_and_its_priority_is_not_this_thread_s(client, monkeypatch):
    threads, words, popen = [], [sys.executable, "-c", "import time; time.sleep(60)"], link_module.subprocess.Popen
    monkeypatch.setattr(link_module.subprocess, "Popen", lambda _, **options: popen(words, **options))
    deaf = UrLink("arm", 500.0, lambda: threads.append(threading.current_thread()))
    processes = []
    monkeypatch.setattr(deaf, "call", lambda *_: processes.append(deaf._process) or {"version": "", "serial": ""})
    deaf.open(LIMIT_S)
    deaf.close()
    assert [process.poll() for process in processes] == [-signal.SIGKILL] * 2
    assert [thread is threading.current_thread() for thread in threads] == [False]


def test_client_s_threads_come_before_whoever_waits_for_it(client, ends, monkeypatch):
    given = []
    monkeypatch.setattr(process_main.os, "sched_getparam", lambda _: SimpleNamespace(sched_priority=30))
    monkeypatch.setattr(process_main.os, "sched_setscheduler", lambda *of: given.append(of[2].sched_priority))
    Served(ends[1], "arm", 500.0)._listen()
    assert given == [30, 29]


def test_missing_client_is_named_with_its_extra(monkeypatch):
    monkeypatch.setattr("palpate.drivers.ur.link.find_spec", lambda name: None)
    with pytest.raises(SettingError, match=r"ur_rtde is not installed.*pip install 'palpate\[ur\]'"):
        UrLink("arm", 500.0).open(LIMIT_S)


@pytest.fixture
def ends():
    pair = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    yield pair
    for end in pair:
        end.close()


def test_newest_set_point_is_sent_and_none_that_came_before_a_stop(client, ends):
    served = Served(ends[1], "arm", 500.0)
    requested = [{"op": "control", "id": 1, "args": [0.0]}, *({"op": "servo", "args": [k]} for k in range(3))]
    for one in requested:
        ends[0].send(json.dumps(one).encode())
    assert served._hear()
    assert client.called("servoJ") == [("servoJ", 2)]
    for one in (requested[1], {"op": "stop", "id": 2, "args": [15.0]}):
        ends[0].send(json.dumps(one).encode())
    assert served._hear()
    assert client.called("servoJ", "servoStop") == [("servoJ", 2), ("servoStop", 15.0)]
    for number in (1, 2):
        assert json.loads(ends[0].recv(1 << 16)) == {"id": number, "value": True}
    ends[0].close()
    assert not served._hear()


def test_state_is_sent_once_and_only_if_it_is_of_one_time(client, ends):
    served = Served(ends[1], "arm", 500.0)
    served._receive = client
    times_s = iter((4.0, 4.0, 4.0, 5.0, 6.0))
    client.answers["getTimestamp"] = lambda: next(times_s)
    for _ in range(3):  # whole; the same; another package came meanwhile
        served._notify_state()
    ends[0].setblocking(False)
    assert json.loads(ends[0].recv(1 << 16)[1:])["timestamp_s"] == 4.0
    with pytest.raises(BlockingIOError):
        ends[0].recv(1 << 16)
