"""An emulated rig in virtual time: the simulated cell behind the emulators' wires, the real drivers before them."""

from contextlib import ExitStack
from dataclasses import replace

from palpate.adapters.config import DeviceEntry, EmulationConfig, RigFile, SensorFactsTable, overlay
from palpate.adapters.hardware.approach import find_approach, move_to_ready
from palpate.adapters.hardware.ati import NetFtForceSensor, NetFtTable
from palpate.adapters.hardware.emulated_cell import EmulatedCell
from palpate.adapters.hardware.plugins import RigContext, arm_maker, force_sensor_maker
from palpate.adapters.hardware.rig import DeviceRig
from palpate.adapters.hardware.ros2 import Ros2ArmTable, Ros2ForceSensor, Ros2WrenchTable, make_ros2_arm
from palpate.adapters.hardware.ur import UrTable, make_ur_rtde
from palpate.core.ports import CONTROL_RATE_HZ, FaultLatch, Ports
from palpate.core.supervision import SampleMonitor
from palpate.drivers.ros2 import WRENCH
from palpate.simulation.emulators.ati import NetFtServer
from palpate.simulation.emulators.lines import PtyServer, SlcanAdapter
from palpate.simulation.emulators.ros2 import Ros2Server
from palpate.simulation.emulators.ur import UrServer
from tests.support.arm_thread import arm_in_thread
from tests.virtual_box import VirtualBox
from tests.virtual_lines import VirtualDesk
from tests.virtual_ros2 import VirtualDomain
from tests.virtual_ur import VirtualUr

_TICK_NS = 10**9 // CONTROL_RATE_HZ
_WAY_RAD_S = 0.8
_TIMEOUT_NS = 100_000_000


class VirtualCell(EmulatedCell):
    """The cell with its devices on a virtual desk, a tick of physics each control period."""

    def __init__(self, desk, config, ready, emulation, begin_ns, late_ns, hidden):
        super().__init__(config, ready, emulation, hidden=hidden)
        for device, table in ((self.arm, "arm"), (self.sensor, "force_sensor")):
            server = device.server
            if isinstance(server, PtyServer) and isinstance(adapter := server._serial.emulator, SlcanAdapter):
                desk.can(table, *adapter.bus._nodes)
            elif isinstance(server, PtyServer):
                desk.serial(table, server._serial.emulator)
            elif isinstance(server, UrServer):
                self.link = VirtualUr(desk.clock, server._controller)
            elif isinstance(server, NetFtServer):
                self.box = VirtualBox(desk.clock, server._box)
            elif isinstance(server, Ros2Server):
                self.domain = VirtualDomain(desk.clock, server._robot)
                self.domain.wrench = server._wrench
        self._begin_ns, self._late_ns, self._done = begin_ns, late_ns, 0
        desk.clock.devices.append(self)

    def next_event_ns(self):
        return self._begin_ns + self._done * _TICK_NS + self._late_ns(self._done)

    def step(self, now_ns):
        while self.next_event_ns() <= now_ns:
            self._done += 1
            self.tick(now_ns)


class VirtualRig(DeviceRig):
    """What ``palpate run --rig`` has of such a rig, the arm's process a thread."""

    def __init__(self, config, ready, arm, force, hidden, *, phase=0.0, late_ns=lambda tick: 0):
        self.desk, self.latch = VirtualDesk(), FaultLatch()
        self._config, self._approach = config, find_approach(config, ready)
        emulation = EmulationConfig(wires=arm, force=force)
        clock = self.desk.clock
        self.cell = VirtualCell(
            self.desk, config, ready, emulation, clock.now_ns() + round(phase * _TICK_NS), late_ns, hidden
        )
        context = replace(RigContext.of(config.arm, clock), tool=config.tool, accept_kinematics=True)
        if arm == "ur-rtde":
            stated = self.cell.arm.entries() | {"host": "virtual", "timeout_scale": 1.0}
            del stated["adapter"]
            made = make_ur_rtde(overlay(UrTable(), stated), context, lambda: self.cell.link)
        elif arm == "ros2":
            made = make_ros2_arm(Ros2ArmTable(), context, self.cell.domain.link)
        else:
            made = arm_maker(arm)(_arm_table(arm, self.cell), context)
        client = arm_in_thread(made, clock, _TIMEOUT_NS)

        if force == "ati-netft":
            sensor = NetFtForceSensor(NetFtTable(), clock, self.cell.box.open)
        elif force == "ros2":
            sensor = Ros2ForceSensor(lambda: self.cell.domain.link("wrench", WRENCH, ""), clock, Ros2WrenchTable())
        else:
            sensor = force_sensor_maker(force)(_sensor_table(), context)
        facts = overlay(SensorFactsTable(), self.cell.sensor.facts)
        file = RigFile("virtual rig", DeviceEntry(arm, {}), DeviceEntry(force, {}), facts=facts)
        super().__init__(file, sensor, client)
        self.ports = Ports(clock, sensor, client, client)
        self._at_ready = False

    def prepare(self, trial):
        self.ports.arm.deactivate()
        self.ports.arm.activate()
        if not self._at_ready:
            monitor = SampleMonitor(self._config.supervision, self.sensor_facts)
            move_to_ready(self._approach, self.ports, _WAY_RAD_S, self._config.task.max_force_N, monitor)
            self._at_ready = True
        self.ports.force_sensor.read()

    def stopped_by(self):
        return self.ports.arm.fault or ""

    def __enter__(self):
        self.desk.clock.sleep(0.1)
        with ExitStack() as opened:
            self._open(opened)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, kind, error, trace):
        self.ports.arm.stop()
        self._opened.close()
        self.desk.close()


def _arm_table(arm, cell):
    if arm == "zebra-nmc":
        return {"port": "arm", "baud": 230_400, "adapter_latency_ms": 0.0, "divider": 2, "at_home": True,
                "reset_wait_ms": 20.0}  # fmt: skip
    scale = list(cell.arm.motors._gears._scale)
    nodes = [axis + 1 for axis in range(len(scale))]
    return {"interface": "virtual", "channel": "arm", "divider": 2, "nodes": nodes, "counts_per_rad": scale}


def _sensor_table():
    return {"interface": "virtual", "channel": "force_sensor", "node": 9}
