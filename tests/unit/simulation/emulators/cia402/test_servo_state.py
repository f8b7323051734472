import pytest

from palpate.simulation.emulators.cia402.servo import PowerMachine, PowerState

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
CASES = [
    (state, word, moves.get(word, state)) for state, moves in TABLE.items() for word in (0x00, 0x02, 0x06, 0x07, 0x0F)
]


@pytest.mark.parametrize(("state", "word", "end"), [*CASES, (S.FAULT, 0x80, S.SWITCH_ON_DISABLED)])
def test_transitions(state: PowerState, word: int, end: PowerState) -> None:
    machine = PowerMachine()
    machine.state = state
    machine.apply(word, fault_persists=False)
    assert machine.state is end


@pytest.mark.parametrize(
    ("state", "word"),
    [
        (S.NOT_READY, 0x0200),
        (S.SWITCH_ON_DISABLED, 0x0240),
        (S.READY, 0x0231),
        (S.SWITCHED_ON, 0x0233),
        (S.ENABLED, 0x1237),
        (S.QUICK_STOP, 0x0217),
        (S.FAULT_REACTION, 0x021F),
        (S.FAULT, 0x0208),
    ],
)
def test_statuswords(state: PowerState, word: int) -> None:
    machine = PowerMachine()
    machine.state = state
    assert machine.statusword == word


def test_fault_reset_acts_on_the_rising_edge_only() -> None:
    machine = PowerMachine()
    machine.apply(0x80, fault_persists=False)
    machine.state = S.FAULT
    machine.apply(0x80, fault_persists=False)
    assert machine.state is S.FAULT
    machine.apply(0x00, fault_persists=False)
    machine.apply(0x80, fault_persists=True)
    assert machine.state is S.FAULT
    machine.apply(0x00, fault_persists=False)
    machine.apply(0x80, fault_persists=False)
    assert machine.state is S.SWITCH_ON_DISABLED
