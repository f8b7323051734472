"""Faults of devices, and of sensors whose every sample could be true, for simulated trials."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import tau
from typing import Any

from palpate.core.ports import CONTROL_RATE_HZ
from tests.support.faults import FaultPlan


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        plans: Fields of its plans, without tick and seed; more than one where faults come together.
        silent_ticks: Ticks that pass before a port can show it. None where that depends on the arm's motion: then only
            harm counts.
        plausible: Whether every single sample could be true.
        adversarial: Whether no physical mechanism causes it.
        noise_share: Noise added to the force sensor, as a share of the sensor's own.
    """

    name: str
    plans: tuple[Mapping[str, Any], ...]
    silent_ticks: int | None = None
    plausible: bool = False
    adversarial: bool = False
    noise_share: float = 0.0

    def at(self, tick, seed, sensor):
        """Return the plans for a fault that begins at a tick."""
        noise = [
            {"kind": "noise", "port": "force_sensor", "magnitude": self.noise_share * deviation, "channels": channels}
            for deviation, channels in ((sensor.noise_N, (0, 1, 2)), (sensor.noise_Nm, (3, 4, 5)))
            if self.noise_share * deviation > 0.0
        ]
        return [
            FaultPlan(first_tick=tick, seed=seed + number, **plan) for number, plan in enumerate((*self.plans, *noise))
        ]


def device_faults(config):
    """List faults of every kind on every port."""
    quiet_ticks, faults = config.max_repeats, list[Fault]()

    def add(name, silent_ticks, *, plausible=False, **plan):
        faults.append(Fault(name, (plan,), silent_ticks, plausible))

    for port in ("force_sensor", "joint_encoder"):
        add(f"{port} drops all", quiet_ticks, kind="drop", port=port)
        add(f"{port} drops one in three", None, kind="drop", port=port, probability=0.33)
        add(f"{port} 3 ticks late", None, kind="delay", port=port, delay_ticks=3)
        add(f"{port} half a second late", quiet_ticks, kind="delay", port=port, delay_ticks=70)
        add(f"{port} duplicates", None, kind="duplicate", port=port, probability=0.5)
        add(f"{port} repeats", quiet_ticks, kind="repeat", port=port)
        add(f"{port} not a number", 0, kind="nan", port=port)
        add(f"{port} disconnected", 0, kind="disconnect", port=port)
    force = {"port": "force_sensor"}
    axial = {**force, "channels": (2,)}
    joints = {"port": "joint_encoder"}
    add("force_sensor frozen", config.max_equal_samples, kind="freeze", **force)
    add("force_sensor drifts 5 N/s", None, plausible=True, kind="bias-drift", magnitude=5.0, **axial)
    add("force_sensor spike 100 N", 0, kind="spike", magnitude=100.0, duration_ticks=1, **axial)
    add("force_sensor saturated, marked", 0, kind="saturate", magnitude=2.0, **force)
    add("force_sensor saturated, not marked", None, plausible=True, kind="saturate", magnitude=2.0, honest=False,
        **force)  # fmt: skip
    add("force_sensor in grams", None, kind="unit", factor=1000.0, **force)
    add("force_sensor in kgf", None, plausible=True, kind="unit", factor=1.0 / 9.80665, **force)
    add("joint_encoder frozen", None, kind="freeze", **joints)
    add("joint_encoder drifts 2 mrad/s", None, plausible=True, kind="bias-drift", magnitude=2e-3, channels=(2,),
        **joints)  # fmt: skip
    add("joint_encoder spike 0.1 rad", 0, kind="spike", magnitude=0.1, channels=(1,), **joints)
    add("joint_encoder in degrees", 0, kind="unit", factor=57.29577951308232, **joints)
    add("arm loses all commands", None, kind="drop", port="arm")
    add("arm loses one command in three", None, kind="drop", port="arm", probability=0.33)
    add("arm 3 ticks late", None, kind="delay", port="arm")
    add("arm not a number", 0, kind="nan", port="arm")
    add("arm disconnected", 0, kind="disconnect", port="arm")
    add("arm stuck", None, kind="stuck", port="arm")
    add("arm in degrees", None, kind="unit", port="arm", factor=57.29577951308232)
    add("clock jumps 1 s", 0, kind="clock-jump", port="clock", time_s=1.0)
    add("ticks take 0.1 s", 0, kind="overrun", port="clock", time_s=0.1)
    add("ticks take 10 ms longer", None, kind="overrun", port="clock", time_s=0.01, probability=0.2)
    return faults


def sensor_faults():
    """List faults whose every sample could be true, alone and two at once; each lasts to the end of the trial."""
    force, joints = {"port": "force_sensor"}, {"port": "joint_encoder"}
    frozen, turned = {"kind": "freeze"} | force, {"kind": "unit", "factor": -1.0} | force
    repeated = {"kind": "repeat", "honest": False} | force
    second = repeated | {"span_ticks": 140}
    lag, late = {"kind": "lag", "time_s": 1e-3}, {"kind": "lag", "honest": False} | force
    turn, drift = {"kind": "offset"} | joints, {"kind": "bias-drift", "magnitude": 2e-3, "channels": (2,)} | joints
    channels = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
    return [
        _sensor_fault("dead with 0.06 of its noise", frozen, noise_share=0.06),
        _sensor_fault("dead with its own noise", frozen, noise_share=1.0),
        *(_sensor_fault(f"{name} frozen", frozen | {"channels": (k,)}) for k, name in enumerate(channels)),
        _sensor_fault("dishonest repeat of 0.1 s", repeated, adversarial=True),
        _sensor_fault("dishonest repeat of 1 s", second, adversarial=True),
        *(_sensor_fault(f"force times {scale:g}", _scaled(scale)) for scale in (0.01, 0.1, 0.5, 2.0, 10.0, 100.0)),
        _sensor_fault("sign flipped", turned),
        _sensor_fault("Fz sign flipped", turned | {"channels": (2,)}),
        _sensor_fault("Fx and Fz swapped", _swapped(0, 2)),
        _sensor_fault("Fx and Fy, Tx and Ty swapped", _swapped(0, 1), _swapped(3, 4)),
        _sensor_fault("forces and torques swapped", _swapped(0, 3), _swapped(1, 4), _swapped(2, 5)),
        _sensor_fault("force later by 1 ms a second", lag | force),
        _sensor_fault("force later by 1 ms a second, new times", lag | force | {"honest": False}),
        _sensor_fault("encoder later by 1 ms a second", lag | joints),
        _sensor_fault("encoder later by 1 ms a second, new times", lag | joints | {"honest": False}),
        _sensor_fault("encoder 2 off by a turn", turn | {"magnitude": tau, "channels": (1,)}),
        _sensor_fault("encoder 6 off by a turn back", turn | {"magnitude": -tau, "channels": (5,)}),
        _sensor_fault("force times 0.5 and 1 ms a second later", _scaled(0.5), lag | force),
        _sensor_fault("sign flipped and times 0.1", turned, _scaled(0.1)),
        _sensor_fault("dead with its own noise, encoder 6 off by a turn", frozen,
                      turn | {"magnitude": tau, "channels": (5,)}, noise_share=1.0),
        _sensor_fault("dead with its own noise, encoder 3 drifts 2 mrad/s", frozen, drift, noise_share=1.0),
        _sensor_fault("force times 0.1, encoder 3 drifts 2 mrad/s", _scaled(0.1), drift),
        _sensor_fault("Fz frozen, Fx and Fy swapped", frozen | {"channels": (2,)}, _swapped(0, 1)),
        _sensor_fault("dishonest repeat of 1 s, times 0.5", second, _scaled(0.5), adversarial=True),
        _noisy("dishonest repeat of 1 s", second, adversarial=True),
        _noisy("dishonest repeat of 1 s, times 0.3", second, _scaled(0.3), adversarial=True),
        _noisy("dishonest repeat of 1 s, sign flipped", second, turned, adversarial=True),
        _noisy("dishonest repeat of 0.1 s", repeated, adversarial=True),
        _noisy("force times 0.01", _scaled(0.01)),
        _noisy("force times 0.1", _scaled(0.1)),
        _noisy("dead with three times its noise", frozen, share=3.0),
        _sensor_fault("force later by 0.2 s a second, new times", late | {"time_s": 0.2}),
        _sensor_fault("torques times 0.1", *(_scaled(0.1) | {"channels": (k,)} for k in (3, 4, 5))),
        *(
            _noisy(
                f"back by {ticks / CONTROL_RATE_HZ:g} s at once",
                {"kind": "delay", "honest": False, "delay_ticks": ticks} | force,
                adversarial=True,
            )
            for ticks in (21, 42, 70)
        ),
        *(_moved("Fz", "drifts by", "N/s", "bias-drift", size, 2) for size in (-7.0, 1.0, 7.0, 15.0)),
        *(_moved("Fz", "off by", "N", "offset", size, 2) for size in (-3.0, 3.0, 10.0)),
        _moved("Fx", "drifts by", "N/s", "bias-drift", 3.0, 0),
        _moved("Fx", "off by", "N", "offset", 5.0, 0),
        _moved("Tx", "off by", "N m", "offset", 0.3, 3),
    ]  # fmt: skip


def _sensor_fault(name, *plans, adversarial=False, noise_share=0.0):
    return Fault(name, plans, plausible=True, adversarial=adversarial, noise_share=noise_share)


def _noisy(name, *plans, adversarial=False, share=1.0):
    return _sensor_fault(f"{name}, fresh noise", *plans, adversarial=adversarial, noise_share=share)


def _moved(channel, how, unit, kind, size, number):
    plan = {"kind": kind, "port": "force_sensor", "magnitude": size, "channels": (number,)}
    return _sensor_fault(f"{channel} {how} {size:g} {unit}", plan)


def _scaled(factor):
    return {"kind": "unit", "port": "force_sensor", "factor": factor}


def _swapped(one, other):
    return {"kind": "swap", "port": "force_sensor", "channels": (one, other)}
