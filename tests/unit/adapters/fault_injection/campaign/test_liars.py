"""Sensors that lie: each is another one, and noise of their own is on every channel, on top of the lie."""

from palpate.adapters.fault_injection.campaign.liars import liars
from palpate.core.ports import SensorFacts


def test_no_two_have_one_name() -> None:
    names = [liar.name for liar in liars()]
    assert len(set(names)) == len(names)


def test_fresh_noise_comes_after_the_lie_on_every_channel() -> None:
    noisy = [liar for liar in liars() if liar.name.endswith("fresh noise")]
    assert noisy
    for liar in noisy:
        *lies, force, torque = liar.at(5, 0, SensorFacts(0.1, 0.004))
        assert lies
        assert (force.kind, force.channels, force.magnitude) == ("noise", (0, 1, 2), liar.noise_share * 0.1)
        assert (torque.kind, torque.channels, torque.magnitude) == ("noise", (3, 4, 5), liar.noise_share * 0.004)
