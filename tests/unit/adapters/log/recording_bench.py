"""The four fake ports under a recorder, and a loop over them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from palpate.adapters.contracts import FakeClock
from palpate.adapters.log.container import read_messages
from palpate.adapters.log.reader import TrialLog, assemble
from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.records import EndRecord, StartRecord
from palpate.adapters.log.sink import Sink
from palpate.core.control_loop import tick_time_ns
from palpate.core.ports.values import JointCommand, Snapshot
from palpate.core.trial.report import TrialReport, TrialSetup
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.crafted import STARTING

HOME_RAD = (0.1, -0.2, 0.3)


class TroubledSink(MemorySink):
    """May have troubles to report."""

    def __init__(self) -> None:
        super().__init__()
        self.tells: list[str] = []

    def trouble(self) -> str | None:
        return self.tells.pop(0) if self.tells else None


class Bench:
    """Fakes, active, and the events of a loop over them."""

    def __init__(self, sink: Sink | None = None, *, start_ns: int = 0, stop_on_trouble: bool = False) -> None:
        self.sink = sink or MemorySink()
        self.recorder = FlightRecorder(self.sink, stop_on_trouble=stop_on_trouble)
        self.report = TrialReport(TrialSetup(0, 0, (0.0, 0.0)))
        self.clock = FakeClock(start_ns)
        self.arm = FakeArm(self.clock, HOME_RAD, lower_rad=(-1.0,) * 3, upper_rad=(1.0,) * 3, max_step_rad=0.02)
        self.sensor = FakeForceSensor(self.clock)
        self.encoder = FakeJointEncoder(self.clock, self.arm.position_rad)
        for device in (self.sensor, self.encoder, self.arm):
            device.configure()
            device.activate()
        self.tick, self.start_ns = 0, start_ns

    @classmethod
    def running(cls, ticks: int, sink: Sink | None = None, **more: Any) -> Self:
        """In the middle of a trial."""
        bench = cls(sink, **more)
        bench.begin()
        bench.run(ticks)
        return bench

    def begin(self, path: Path = Path("x.mcap"), start: Callable[[], StartRecord] = lambda: STARTING) -> None:
        self.recorder.begin(path, {}, start)
        self.tick, self.start_ns = 0, self.clock.now_ns()
        self.recorder.begun(self.start_ns, self.report)

    def run(self, ticks: int) -> None:
        """As the core's loop does."""
        for _ in range(ticks):
            deadline_ns = self.wait()
            self.clock.sleep_until(deadline_ns)
            self.sensor.load_N = (0.0, 0.0, -float(self.tick))
            snapshot = Snapshot(self.tick, self.clock.now_ns(), self.sensor.read(), self.encoder.read())
            command = JointCommand(self.command(self.tick))
            self.recorder.sent(snapshot, command, self.arm.send(command))
            self.tick += 1

    def wait(self) -> int:
        """The next tick comes; its deadline."""
        deadline_ns = tick_time_ns(self.start_ns, self.tick)
        self.recorder.waited(self.tick, deadline_ns)
        return deadline_ns

    @staticmethod
    def command(tick: int) -> tuple[float, ...]:
        return (0.1 + 1e-5 * tick, -0.2, 0.3)

    def end(self, **facts: Any) -> None:
        self.recorder.end(EndRecord(tick=self.tick - 1, **facts))

    def log(self, number: int = -1) -> TrialLog:
        """A log that the memory sink holds."""
        assert isinstance(self.sink, MemorySink)
        return log_of(self.sink.logs[number])


def log_of(data: bytes) -> TrialLog:
    return assemble("x.mcap", data, *read_messages("x.mcap", data))


def ticks_of(log: TrialLog) -> list[int]:
    return [record.tick for record in log.records()]
