"""What the drives hear while they are set up, byte for byte, written from CiA 301 by hand."""

import pytest

from palpate.drivers.cia402.object_dictionary import OperationMode
from tests.support.cia402_bench import Bench

COMMON = [
    "2B40600002000000",  # 6040 := 0002 quick stop, should the drive still be under power
    "2B07600000000000",  # 6007 := 0, the watchdog off while nobody sends heartbeats
    "2316100100000000",  # 1016:01 := 0
    "2301140101030080",  # 1401:01 := 80000301, the maker's own PDOs off
    "2301180181020080",  # 1801:01 := 80000281
    "2302140101040080",
    "2302180181030080",
    "2303140101050080",
    "2303180181040080",
    "2300140101020080",  # 1400:01 := 80000201, off while it is mapped
    "2F00160000000000",  # 1600:00 := 0
    "2300160110004060",  # 1600:01 := 60400010
    None,  # 1600:02, by mode
    "2F00160002000000",  # 1600:00 := 2
    "2F00140201000000",  # 1400:02 := 1, acts at the next SYNC
    "2300140101020000",  # 1400:01 := 00000201
    "2300180181010080",  # 1800:01 := 80000181
    "2F001A0000000000",
    "23001A0110004160",  # 1A00:01 := 60410010
    "23001A0220006460",  # 1A00:02 := 60640020
    "23001A0308006160",  # 1A00:03 := 60610008
    "2F001A0003000000",
    "2F00180201000000",  # 1800:02 := 1, sent at every SYNC
    "2300180181010000",  # 1800:01 := 00000181
    "2B17100032000000",  # 1017 := 50 ms
    "2FC2600147000000",  # 60C2:01 := 71
    "2FC26002FC000000",  # 60C2:02 := -4, together 7.1 ms
    "2B5A600006000000",  # 605A := 6, stay in quick stop
    "2385600030E60200",  # 6085 := 190000 counts/s2
    None,  # 6060, by mode
    "4061600000000000",  # read 6061
]


@pytest.mark.parametrize(
    ("mode", "target", "operation"),
    [
        (OperationMode.CSP, "2300160220007A60", "2F60600008000000"),
        (OperationMode.CSV, "230016022000FF60", "2F60600009000000"),
    ],
)
def test_sdo_frames_of_the_set_up(mode: OperationMode, target: str, operation: str) -> None:
    bench = Bench(mode=mode)
    bench.arm.open()
    sent = [data.hex().upper() for can_id, data in bench.network.sent if can_id == 0x601]
    chosen = iter((target, operation))
    expected = [next(chosen) if frame is None else frame for frame in COMMON]
    assert sent[:6] == [
        "4000100000000000",
        "4018100100000000",
        "4018100200000000",
        "4018100300000000",
        "4018100400000000",
        "4008100000000000",
    ]
    assert sent[6:] == expected


def test_nmt_goes_to_each_drive_alone() -> None:
    bench = Bench()
    bench.arm.open()
    nmt = [data.hex() for can_id, data in bench.network.sent if can_id == 0]
    assert nmt == [f"80{node:02x}" for node in range(1, 7)] + [f"01{node:02x}" for node in range(1, 7)]


def test_the_layout_of_a_cycle() -> None:
    bench = Bench(host_watchdog_ms=0).enabled()
    bench.cycle()
    bench.network.sent.clear()
    bench.cycle((0.005, -0.005, 0.0, 0.0, 0.0, 0.001))
    # Controlword 000F and the target in counts, little-endian, in the order of the joints; the SYNC comes last.
    assert [(can_id, data.hex()) for can_id, data in bench.network.sent] == [
        (0x201, "0f0032000000"),
        (0x202, "0f00ceffffff"),
        (0x203, "0f0000000000"),
        (0x204, "0f0000000000"),
        (0x205, "0f0000000000"),
        (0x206, "0f000a000000"),
        (0x080, ""),
    ]


def test_the_watchdog_is_armed_before_power_and_fed_by_the_cycle() -> None:
    bench = Bench()
    bench.arm.open()
    bench.network.sent.clear()
    bench.arm.enable()
    sdo = [data.hex().upper() for can_id, data in bench.network.sent if can_id == 0x601]
    assert sdo == ["2B07600003000000", "2316100164007E00"]  # quick stop, node 126 within 100 ms
    bench.network.sent.clear()
    bench.cycle(times=140)
    beats = [data for can_id, data in bench.network.sent if can_id == 0x77E]
    assert set(beats) == {b"\x05"}
    assert 25 <= len(beats) <= 32
    bench.network.sent.clear()
    bench.arm.disable()
    sdo = [data.hex().upper() for can_id, data in bench.network.sent if can_id == 0x601]
    assert sdo == ["2B07600000000000", "2316100100000000"]
