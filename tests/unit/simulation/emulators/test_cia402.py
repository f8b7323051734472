"""The CiA 402 drive: its state machine, what it answers, byte for byte, and how another client drives it."""

import pytest
from canopen.objectdictionary import ObjectDictionary, ODVariable, datatypes
from canopen.profiles.p402 import BaseNode402

from palpate.simulation.emulators.cia402 import CanopenDrive
from palpate.simulation.emulators.cia402.servo import PowerMachine, PowerState
from palpate.simulation.emulators.motors import DirectGears, JointPlant
from tests.support import cia402_vectors as golden
from tests.support.cia402_bench import FakeNetwork

S = PowerState
# Controlword by state, after the state diagram of CiA 402-2: what each command leads to; absent means no change.
TABLE = {
    S.NOT_READY: {},
    S.SWITCH_ON_DISABLED: {0x06: S.READY},
    S.READY: {0x00: S.SWITCH_ON_DISABLED, 0x02: S.SWITCH_ON_DISABLED, 0x07: S.SWITCHED_ON, 0x0F: S.ENABLED},
    S.SWITCHED_ON: {0x00: S.SWITCH_ON_DISABLED, 0x02: S.SWITCH_ON_DISABLED, 0x06: S.READY, 0x0F: S.ENABLED},
    S.ENABLED: {0x00: S.SWITCH_ON_DISABLED, 0x02: S.QUICK_STOP, 0x06: S.READY, 0x07: S.SWITCHED_ON},
    S.QUICK_STOP: {0x00: S.SWITCH_ON_DISABLED, 0x0F: S.ENABLED},
    S.FAULT_REACTION: {},
    S.FAULT: {0x80: S.SWITCH_ON_DISABLED},
}


@pytest.mark.parametrize("state", TABLE)
def test_controlword_leads_where_the_standard_says(state):
    for word in (0x00, 0x02, 0x06, 0x07, 0x0F, 0x80):
        machine = PowerMachine()
        machine.state = state
        machine.apply(word)
        # Bit 7 means nothing but in a fault: 0x80 is then "disable voltage".
        expected = TABLE[state].get(word & 0x7F if state is not S.FAULT else word, state)
        assert machine.state is expected, hex(word)


@pytest.mark.parametrize("state", PowerState)
def test_statusword_shows_the_state(state):
    machine = PowerMachine()
    machine.state = state
    assert machine.statusword == golden.STATUSWORDS[state.name][0]


def test_fault_reset_acts_on_the_rising_edge_only():
    machine = PowerMachine()
    machine.apply(0x80)
    machine.state = S.FAULT
    for word, state in ((0x80, S.FAULT), (0x00, S.FAULT), (0x80, S.SWITCH_ON_DISABLED)):
        machine.apply(word)
        assert machine.state is state


@pytest.fixture
def drive():
    drive = CanopenDrive(1, JointPlant((0.0,), DirectGears((1000.0,))), 0)
    drive.advance(0)
    (boot,) = drive.advance(10_000_000)
    assert (boot.arbitration_id, boot.data) == (0x701, b"\x00")
    return drive


def answer(drive, request):
    frames = drive.feed(0x601, bytes.fromhex(request), 10_000_000)
    (data,) = [frame.data for frame in frames if frame.arbitration_id == 0x581]
    return data.hex().upper()


def test_drive_answers_the_golden_requests_of_a_set_up(drive):
    for request, expected in golden.IDENTIFY.items():
        assert answer(drive, request) == (expected or answer(drive, request))
    *downloads, upload = golden.SET_UP
    for request in (*downloads, *golden.WATCHDOG_ON, *golden.WATCHDOG_OFF):
        assert answer(drive, request) == "60" + request[2:8] + "00000000"
    assert answer(drive, upload) == "4F61600008000000"


@pytest.mark.parametrize(("request_", "code"), golden.REFUSED.items())
def test_drive_refuses_with_the_abort_code_of_the_standard(drive, request_, code):
    expected = bytes.fromhex("80" + request_[2:8]) + code.to_bytes(4, "little")
    assert answer(drive, request_) == expected.hex().upper()


def test_heartbeat_nmt_and_the_loss_of_the_host(drive):
    for request in (*golden.SET_UP, *golden.WATCHDOG_ON):
        answer(drive, request)
    drive.feed(0x000, b"\x01\x01", 10_000_000)
    beats = [frame for ms in range(11, 120) for frame in drive.advance(ms * 1_000_000)]
    assert [(frame.arbitration_id, frame.data) for frame in beats] == [(0x701, b"\x05")] * 2
    drive.feed(0x77E, b"\x05", 120_000_000)
    (lost,) = [frame for ms in range(121, 230) for frame in drive.advance(ms * 1_000_000) if frame.data != b"\x05"]
    assert (lost.arbitration_id, lost.data[:2]) == (0x081, b"\x30\x81")


KINDS = {
    0x6040: datatypes.UNSIGNED16, 0x6041: datatypes.UNSIGNED16, 0x6060: datatypes.INTEGER8, 0x6061: datatypes.INTEGER8,
    0x6064: datatypes.INTEGER32, 0x6502: datatypes.UNSIGNED32,
}  # fmt: skip


def test_public_client_switches_the_drive_on_and_off_and_clears_its_fault(drive):
    network, dictionary = FakeNetwork([drive]), ObjectDictionary()
    for index, kind in KINDS.items():
        entry = ODVariable(hex(index), index)
        entry.data_type = kind
        dictionary.add_object(entry)
    client = BaseNode402(1, dictionary)
    client.associate_network(network)
    client.nmt.state = "OPERATIONAL"
    client.setup_402_state_machine(read_pdos=False)
    client.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    for state, reached in (("OPERATION ENABLED", S.ENABLED), ("SWITCH ON DISABLED", S.SWITCH_ON_DISABLED)):
        client.state = state
        assert (client.state, drive.machine.state) == (state, reached)
    assert client.sdo[0x6064].raw == 0
    drive.fail(0x4210)
    network.sleep(0.1)
    assert client.is_faulted()
    client.reset_from_fault()
    assert drive.machine.state is S.ENABLED
    assert [error.code for error in client.emcy.log] == [0x4210, 0]
