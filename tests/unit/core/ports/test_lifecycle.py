"""The life cycle: every pair of state and request, and what hooks may do to it."""

from functools import partialmethod

import pytest

from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports.lifecycle import TRANSITIONS, Life, LifeRequest, ManagedDevice


class Device(ManagedDevice):
    """Notes which hooks were called; a hook named in ``failing`` raises."""

    def __init__(self, *failing: str) -> None:
        super().__init__("probe")
        self.calls: list[str] = []
        self.failing = failing

    def _note(self, hook: str) -> None:
        self.calls.append(hook)
        if hook in self.failing:
            raise DeviceError("probe", f"{hook} failed")

    _on_configure = partialmethod(_note, "configure")
    _on_activate = partialmethod(_note, "activate")
    _on_deactivate = partialmethod(_note, "deactivate")
    _on_acknowledge = partialmethod(_note, "acknowledge")
    _on_close = partialmethod(_note, "close")


def device_in(life: Life) -> Device:
    device = Device()
    if life is not Life.CONSTRUCTED:
        device.configure()
    if life in (Life.ACTIVE, Life.FAULTED):
        device.activate()
    if life is Life.FAULTED:
        device._latch("too hot")
    if life is Life.CLOSED:
        device.close()
    assert device.life is life
    device.calls.clear()
    return device


PAIRS = [(life, request) for life in Life for request in LifeRequest]


@pytest.mark.parametrize(("life", "request_"), PAIRS)
def test_each_request_in_each_state(life: Life, request_: LifeRequest) -> None:
    device = device_in(life)
    target = TRANSITIONS.get((life, request_))
    ask = getattr(device, request_.value)
    if target is not None:
        ask()
        assert device.life is target
        return
    with pytest.raises(FaultLatchedError if life is Life.FAULTED else LifecycleError):
        ask()
    assert device.life is life
    assert device.calls == []


def test_the_way_to_active_never_starts_at_a_fault() -> None:
    assert [life for (life, _), target in TRANSITIONS.items() if target is Life.ACTIVE] == [Life.CONFIGURED]


def test_an_error_tells_what_would_be_possible() -> None:
    with pytest.raises(LifecycleError) as caught:
        Device().activate()
    assert caught.value.state == "constructed"
    assert caught.value.request == "activate()"
    assert str(caught.value) == (
        "probe: activate() is not possible while constructed; possible now: configure(), close()"
    )


def test_a_failed_hook_leaves_the_state_as_it_was() -> None:
    device = Device("configure")
    with pytest.raises(DeviceError):
        device.configure()
    assert device.life is Life.CONSTRUCTED


def test_a_fault_that_cannot_be_cleared_stays() -> None:
    device = device_in(Life.FAULTED)
    device.failing = ("acknowledge",)
    with pytest.raises(DeviceError):
        device.acknowledge_fault()
    assert device.life is Life.FAULTED
    assert device.fault == "too hot"


def test_the_first_cause_of_a_fault_is_kept() -> None:
    device = device_in(Life.FAULTED)
    device._latch("lost communication")
    assert device.fault == "too hot"
    with pytest.raises(FaultLatchedError) as caught:
        device.activate()
    assert caught.value.cause == "too hot"


def test_a_closed_device_latches_nothing() -> None:
    device = device_in(Life.CLOSED)
    device._latch("late news")
    assert device.life is Life.CLOSED
    assert device.fault is None


def test_a_device_that_fails_to_close_is_closed_all_the_same() -> None:
    device = device_in(Life.ACTIVE)
    device.failing = ("close",)
    with pytest.raises(DeviceError):
        device.close()
    assert device.life is Life.CLOSED
    device.close()


def test_context_manager_closes_after_an_error_inside() -> None:
    device = Device()
    with pytest.raises(KeyError), device:
        raise KeyError
    assert device.life is Life.CLOSED


@pytest.mark.parametrize("hook", ["configure", "activate"])
def test_context_manager_closes_when_it_cannot_be_entered(hook: str) -> None:
    device = Device(hook)
    with pytest.raises(DeviceError, match=hook), device:
        pytest.fail("must not be entered")
    assert device.life is Life.CLOSED
    assert device.calls[-1] == "close"
