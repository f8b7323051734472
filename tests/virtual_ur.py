"""An emulated controller of Universal Robots in virtual time, and a link to it without a process or a socket."""

from palpate.drivers.errors import SilentError, WiringError
from palpate.drivers.ur.link import UrHello, UrLink, UrState
from palpate.drivers.ur.process_main import _VARIABLES as VARIABLES
from palpate.simulation.emulators.ur.controller import CYCLE_NS, ControllerConfig, UrController
from tests.virtual_time import VirtualTime

HOME = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
GONE = "the connection is broken: unplugged"


class VirtualUr(UrLink):
    """The controller, an arm that stands at its set-points, and what a client would make of both."""

    def __init__(self, clock=None, controller=None, **settings):
        self.host = "controller"
        self.clock = clock or VirtualTime()
        self.load = [0.0, 0.0, -5.0, 0.0, 0.0, 0.0]
        self.moves = controller is None
        self.controller = controller or UrController(
            HOME, lambda now_ns: tuple(self.load), ControllerConfig(**settings)
        )
        self.is_open, self.is_plugged, self.is_silent = False, True, False
        self.opened = 0
        self._seen = None
        self._due_ns = 0
        self.clock.devices.append(self)

    def next_event_ns(self):
        return self._due_ns

    def step(self, now_ns):
        self._due_ns = now_ns + CYCLE_NS
        controller = self.controller
        controller.step(now_ns)
        if self.moves:
            controller.measured_rad(controller.targets_rad())
        if not self.is_silent and self.is_plugged:
            values = [controller.read(name) for name in VARIABLES[1:]]  # the first is the time
            self._seen = UrState(now_ns, now_ns * 1e-9, *values)

    def stamp_ns(self):
        return self.clock.now_ns()

    def open(self, timeout_s):
        if not self.is_plugged:
            raise WiringError("controller", GONE, "plug it in")
        self.is_open, self.opened, self._seen = True, self.opened + 1, None
        return UrHello(self.controller.dashboard("PolyscopeVersion"), self.controller.config.serial)

    def call(self, request, timeout_s, *args):
        self._require()
        answer = {"control": self._start, "stop": self._stop, "tcp": self._tcp, "unlock": self._unlock}.get(request)
        return self.controller.remote if answer is None else answer(*args)

    def servo(self, q_rad, step_s, lookahead_s, gain):
        self._require()
        self._write(11, *q_rad, 0.5, 0.5, step_s, lookahead_s, gain)

    def state(self):
        self._require()
        return self._seen

    def close(self):
        self.is_open = False

    def ticks(self, count):
        self.clock.sleep(count / 140)

    def _require(self):
        if not (self.is_open and self.is_plugged):
            raise self._gone()

    def _gone(self):
        return SilentError("controller", GONE, "plug it in")

    def _write(self, command, *doubles):
        for i, value in enumerate(doubles):
            self.controller.write(f"input_double_register_{i}", value)
        self.controller.write("input_int_register_0", command)

    def _command(self, command, *doubles, done=lambda: True):
        self._write(command, *doubles)
        self.clock.sleep(0.005)
        self.clock.wait_for(done, self.clock.now_ns() + 500_000_000)
        self._write(0)
        self.clock.sleep(0.005)

    def _start(self, watchdog_Hz):
        self.controller.end_program()
        self._write(0)
        self.controller.run_script(b"def control():\nend\n")
        self._command(35, watchdog_Hz)
        return True

    def _stop(self, rad_s2):
        self._command(16, rad_s2, done=lambda: self.controller.stationary)
        return True

    def _tcp(self):
        return self.controller.config.tcp_offset

    def _unlock(self):
        answer = self.controller.dashboard("unlock protective stop")
        if not answer.startswith("Protective stop releasing"):
            raise WiringError("controller", answer, "wait")
