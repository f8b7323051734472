from palpate.drivers.cia402.mailbox import Mailbox


class Clock:
    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


def box() -> tuple[Mailbox, Clock]:
    clock = Clock()
    return Mailbox((1, 2), 6, clock), clock


def tpdo(mailbox: Mailbox, node: int, data: bytes = bytes(6)) -> None:
    mailbox.on_tpdo(0x180 + node, bytearray(data), 0.0)


def test_malformed_frames_are_counted_and_change_nothing() -> None:
    mailbox, clock = box()
    mailbox.begin()
    tpdo(mailbox, 1, bytes(5))
    mailbox.on_heartbeat(0x701, bytearray(b"\x05\x05"), 0.0)
    mailbox.on_emcy(0x081, bytearray(b"\x00\x10\x01"), 0.0)
    first = mailbox.wait(clock.now_ns)[0]
    assert (first.malformed, first.answers, first.tpdo, first.nmt_state, first.active) == (3, 0, None, None, ())


def test_heartbeats_boots_and_gaps() -> None:
    mailbox, clock = box()
    for time_ns, state in ((100, 0x7F), (250, 0x05), (300, 0x85), (301, 0x00)):
        clock.now_ns = time_ns
        mailbox.on_heartbeat(0x702, bytearray([state]), 0.0)
        seen = mailbox.look()[1]
        assert seen.nmt_state == state & 0x7F
        assert seen.heartbeat_ns == time_ns
    assert seen.boots == 1
    mailbox.start_over()
    again = mailbox.look()[1]
    assert (again.boots, again.nmt_state) == (0, None)


def test_an_emergency_stays_until_the_node_takes_it_back() -> None:
    mailbox, _ = box()
    mailbox.on_emcy(0x081, bytearray(b"\x11\x86\x21\x01\x02\x03\x04\x05"), 0.0)
    first = mailbox.look()[0]
    assert [(e.code, e.register, e.vendor) for e in first.active] == [(0x8611, 0x21, b"\x01\x02\x03\x04\x05")]
    mailbox.on_emcy(0x081, bytearray(b"\x07\x00\x00\x00\x00\x00\x00\x00"), 0.0)
    first = mailbox.look()[0]
    assert (first.active, first.emergencies) == ((), 1)
    assert [e.code for e in mailbox.statistics().emergencies] == [0x8611, 0x0007]


def test_a_flood_of_emergencies_does_not_grow_without_end() -> None:
    mailbox, _ = box()
    for _ in range(1000):
        mailbox.on_emcy(0x081, bytearray(b"\x00\x10\x01\x00\x00\x00\x00\x00"), 0.0)
    assert mailbox.look()[0].emergencies == 1000
    assert len(mailbox.look()[0].active) <= 65
    assert len(mailbox.statistics().emergencies) == 64
