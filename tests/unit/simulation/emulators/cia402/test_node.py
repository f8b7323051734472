import pytest

from palpate.simulation.emulators.cia402.node import CanopenDrive, NmtState
from palpate.simulation.emulators.cia402.servo import PowerState
from tests.support.ideal_motors import IdealPlant

MS = 1_000_000


class Host:
    """One drive, node 5, on axis 0, with a clock."""

    def __init__(self, *, booted: bool = True) -> None:
        self.plant = IdealPlant()
        self.drive = CanopenDrive(5, self.plant, 0)
        self.now_ns = 0
        self.drive.advance(0)
        if booted:
            self.wait(20)

    def wait(self, milliseconds: int) -> list[tuple[int, str]]:
        heard: list[tuple[int, str]] = []
        for _ in range(milliseconds):
            self.now_ns += MS
            heard += [(f.arbitration_id, f.data.hex()) for f in self.drive.advance(self.now_ns)]
        return heard

    def send(self, identifier: int, data: str = "") -> list[tuple[int, str]]:
        frames = self.drive.feed(identifier, bytes.fromhex(data), self.now_ns)
        return [(f.arbitration_id, f.data.hex()) for f in frames]

    def sdo(self, request: str) -> str:
        answers = self.send(0x605, request)
        assert [identifier for identifier, _ in answers] == [0x585]
        return answers[0][1]

    def map_pdos(self, target: str = "20007a60", mode: str = "08") -> None:
        for request in (
            "2301140105020080",
            "2300140105020080",
            "2f00160000000000",
            "2300160110004060",
            "23001602" + target,
            "2f00160002000000",
            "2300140105020000",
            "2300180185010080",
            "2f001a0000000000",
            "23001a0110004160",
            "23001a0220006460",
            "2f001a0002000000",
            "2300180185010000",
            "2301180185020080",
            "2302180185030080",
            "2303180185040080",
            "2b5a600006000000",
            "2f606000" + mode + "000000",
        ):
            assert self.sdo(request)[:2] == "60", request
        self.send(0, "0105")

    def cycle(self, word: str, target: int = 0) -> str:
        self.send(0x205, word + target.to_bytes(4, "little", signed=True).hex())
        answers = self.send(0x080)
        assert [identifier for identifier, _ in answers] == [0x185]
        return answers[0][1]

    def enable(self, target: int = 0) -> None:
        for word in ("0600", "0700", "0f00"):
            self.cycle(word, target)
            self.wait(1)
        assert self.drive.machine.state is PowerState.ENABLED


def test_boot_up_and_heartbeats() -> None:
    host = Host(booted=False)
    assert host.send(0x605, "4000100000000000") == []
    assert host.wait(20) == [(0x705, "00")]
    assert host.drive.nmt is NmtState.PRE_OPERATIONAL
    host.sdo("2b1710000a000000")
    assert host.wait(30) == [(0x705, "7f")] * 3
    host.send(0, "0100")
    assert host.wait(20) == [(0x705, "05")] * 2
    host.send(0, "0205")
    assert host.wait(10) == [(0x705, "04")]
    assert host.send(0x605, "4000100000000000") == []
    host.send(0, "8005")
    assert host.wait(10) == [(0x705, "7f")]


@pytest.mark.parametrize("command", ["81", "82"])
def test_nmt_resets(command: str) -> None:
    host = Host()
    host.map_pdos()
    assert host.send(0, command + "05") == []
    assert host.wait(20) == [(0x705, "00")]
    assert host.sdo("4000140100000000") == "4300140105020000"


def test_an_nmt_command_for_another_node_is_not_heard() -> None:
    host = Host()
    host.send(0, "0106")
    assert host.drive.nmt is NmtState.PRE_OPERATIONAL


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("4000100000000000", "4300100092010200"),  # device type 402, four bytes
        ("4017100000000000", "4b17100000000000"),  # two bytes
        ("4061600000000000", "4f61600000000000"),  # one byte
        ("4018100400000000", "4318100405100000"),
        ("4008100000000000", "43081000454d5531"),
        ("2b171000f4010000", "6017100000000000"),
        ("2217100000000000", "8017100010000706"),  # no size told: four bytes for a two-byte object
        ("4099990000000000", "8099990000000206"),  # no such object
        ("4018100900000000", "8018100911000906"),  # no such sub-index
        ("2b41600000000000", "8041600002000106"),  # read-only
        ("2f17100001000000", "8017100010000706"),  # wrong length
        ("2f60600003000000", "8060600030000906"),  # profile velocity is not offered
        ("2300160110004060", "8000160122000008"),  # mapped while the PDO is on
        ("2108100004000000", "8008100001000405"),  # segmented
        ("a008100000000000", "8008100001000405"),  # block
    ],
)
def test_sdo_frames(request_: str, answer: str) -> None:
    assert Host().sdo(request_) == answer


def test_an_abort_of_the_client_and_a_short_request_are_not_answered() -> None:
    host = Host()
    assert host.send(0x605, "8000000000000405") == []
    assert host.send(0x605, "400010") == []


@pytest.mark.parametrize(
    ("entry", "code"),
    [("2300160110001810", "41000406"), ("2300160120004060", "41000406"), ("2300160110009999", "41000406")],
)
def test_what_cannot_be_mapped(entry: str, code: str) -> None:
    host = Host()
    host.sdo("2300140105020080")
    host.sdo("2f00160000000000")
    assert host.sdo(entry)[8:] == code


def test_a_mapping_that_is_too_long() -> None:
    host = Host()
    host.sdo("2300140105020080")
    host.sdo("2f00160000000000")
    for sub in "123":
        host.sdo(f"2300160{sub}20007a60")
    assert host.sdo("2f00160003000000")[8:] == "42000406"
    assert host.sdo("2f00160009000000")[8:] == "30000906"
    host.sdo("2f00160001000000")
    assert host.sdo("2300160220007a60")[8:] == "22000008"


def test_process_data_on_sync() -> None:
    host = Host()
    host.plant.set_motor_counts(0, 0x12345678)
    host.map_pdos()
    host.wait(1)
    assert host.cycle("0000") == "400278563412"
    # A set-point acts at the next SYNC, and what is sent there was true before.
    assert host.cycle("0600") == "400278563412"
    assert host.cycle("0600") == "310278563412"


def test_process_data_need_operation() -> None:
    host = Host()
    host.map_pdos()
    host.send(0, "8005")
    assert host.send(0x080) == []


def test_a_fault_without_power_moves_nothing() -> None:
    host = Host()
    host.plant.set_motor_counts(0, 500)
    host.drive.fail(0x3210, b"\x01\x02")
    assert host.wait(1) == [(0x085, "1032010102000000")]
    host.wait(10)
    assert host.plant.motor_counts(0) == 500
    assert host.drive.machine.state is PowerState.FAULT


def test_an_rpdo_that_acts_at_once() -> None:
    host = Host()
    host.map_pdos()
    host.sdo("2f001402ff000000")
    host.send(0x205, "060000000000")
    assert host.drive.machine.state is PowerState.READY
    host.send(0x205, "0700")  # too short for its mapping
    assert host.drive.machine.state is PowerState.READY


def test_every_third_sync() -> None:
    host = Host()
    host.map_pdos()
    host.sdo("2f00180203000000")
    assert [len(host.send(0x080)) for _ in range(6)] == [0, 0, 1, 0, 0, 1]
