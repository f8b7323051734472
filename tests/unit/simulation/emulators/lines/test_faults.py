import numpy as np
import pytest

from palpate.simulation.emulators.lines.faults import Delivery, FaultInjector, SerialFaults
from tests.unit.simulation.emulators.nmc_host import command

NOP = command(1, 0xE)


@pytest.mark.parametrize(
    "field", ["drop_byte", "corrupt_byte", "duplicate_byte", "drop_reply", "duplicate_reply", "wrong_checksum"]
)
def test_faults_strike_as_often_as_asked_and_alike_for_one_seed(field: str) -> None:
    def run() -> tuple[list[list[Delivery]], int]:
        injector = FaultInjector(np.random.default_rng(7))
        injector.faults = SerialFaults(**{field: 0.25})
        sent = [injector.on_reply(b"\x00\x11\x22\x33") for _ in range(1_000)]
        return sent, injector.injected[field]

    first, count = run()
    assert run() == (first, count)
    chances = 4_000 if field.endswith("byte") else 1_000
    assert count == pytest.approx(0.25 * chances, rel=0.15)
    untouched = sum(deliveries == [Delivery(b"\x00\x11\x22\x33")] for deliveries in first)
    assert 0 < untouched < 1_000


def test_commands_can_be_corrupted() -> None:
    injector = FaultInjector(np.random.default_rng(7))
    injector.faults = SerialFaults(corrupt_command_byte=1.0)
    assert all(a ^ b in (1, 2, 4, 8, 16, 32, 64, 128) for a, b in zip(injector.on_command(NOP), NOP, strict=True))


@pytest.mark.parametrize("wrong", [{"drop_byte": 1.5}, {"drop_reply": -0.1}, {"delay_s": -1.0}])
def test_impossible_faults_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"is refused: a number from 0"):
        SerialFaults(**wrong)
