"""Wrapper that runs a third-party arm adapter, with its own ports and life cycles, in the arm process."""

from collections.abc import Mapping, Sequence

from typing_extensions import override

from palpate.adapters.hardware.plugins import ArmAdapter, RigContext
from palpate.adapters.hardware.served_arm import ServedArm
from palpate.core.errors import DeviceError
from palpate.core.ports import AppliedCommand, Device, JointCommand, JointSample, JointVector, Life


class AdapterArm(ServedArm):
    """Encoders and servos with a shared life cycle; they may be separate objects."""

    answers = True

    def __init__(self, adapter: ArmAdapter, context: RigContext) -> None:
        self.name = str(getattr(adapter.arm, "name", "arm"))
        self.limiter = context.limiter
        self._adapter = adapter
        devices: tuple[Device, ...] = (adapter.encoder, adapter.arm)
        self._devices = tuple({id(device): device for device in devices}.values())
        self.listens_unpowered = len(self._devices) > 1

    @property
    @override
    def is_faulted(self) -> bool:
        return any(device.life is Life.FAULTED for device in self._devices)

    @override
    def open(self) -> Sequence[str]:
        try:
            for device in self._devices:
                device.configure()
        except BaseException:
            self.close()
            raise
        return ()

    @override
    def enable(self) -> None:
        try:
            for device in self._devices:
                device.activate()
        except BaseException:
            self.disable()
            raise

    @override
    def cycle(self, setpoint_rad: JointVector | None) -> tuple[JointSample, AppliedCommand | None]:
        self._require_sound()
        try:
            applied = None if setpoint_rad is None else self._adapter.arm.send(JointCommand(setpoint_rad))
            return self._adapter.encoder.read(), applied
        finally:
            # The fault is more informative than a refusal that it causes.
            self._require_sound()

    def _require_sound(self) -> None:
        for device in self._devices:
            if device.life is Life.FAULTED:
                raise DeviceError(self.name, device.fault or "a fault without a description")

    @override
    def stop(self) -> None:
        self._adapter.arm.stop()

    @override
    def disable(self) -> None:
        for device in reversed(self._devices):
            if device.life is Life.ACTIVE:
                device.deactivate()

    @override
    def acknowledge(self) -> None:
        for device in self._devices:
            if device.life is Life.FAULTED:
                device.acknowledge_fault()
        self.disable()

    @override
    def close(self) -> None:
        for device in reversed(self._devices):
            device.close()

    @override
    def listen(self) -> bool:
        self._adapter.encoder.activate()
        return True

    @override
    def diagnostics(self) -> Mapping[str, str]:
        found: Mapping[str, str] = getattr(self._adapter.arm, "diagnostics", dict)()
        return found


def served(made: ArmAdapter | ServedArm, context: RigContext) -> ServedArm:
    """Wrap a third-party adapter so that the arm process can serve it; return a palpate driver unchanged."""
    return made if isinstance(made, ServedArm) else AdapterArm(made, context)
