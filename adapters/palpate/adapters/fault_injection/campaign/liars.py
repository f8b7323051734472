"""Sensors that lie plausibly: every single sample could be true, and what they show is not."""

from collections.abc import Mapping
from math import tau
from typing import Any, Final

from palpate.adapters.fault_injection.campaign.variants import Variant
from palpate.core.ports import CONTROL_RATE_HZ

_CHANNELS: Final = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_SCALES: Final = (0.01, 0.1, 0.5, 2.0, 10.0, 100.0)
_MS_EACH_SECOND: Final = 1e-3


def liars() -> list[Variant]:
    """Every way of lying, alone and two at once; each lasts to the end of the trial."""
    force, joints = {"port": "force_sensor"}, {"port": "joint_encoder"}
    frozen, turned = {"kind": "freeze"} | force, {"kind": "unit", "factor": -1.0} | force
    repeated = {"kind": "repeat", "honest": False} | force
    made = [
        _liar("dead with 0.06 of its noise", frozen, noise_share=0.06),
        _liar("dead with its own noise", frozen, noise_share=1.0),
        *(_liar(f"{name} frozen", frozen | {"channels": (k,)}) for k, name in enumerate(_CHANNELS)),
        _liar("dishonest repeat of 0.1 s", repeated),
        _liar("dishonest repeat of 1 s", repeated | {"span_ticks": 140}),
        *(_liar(f"force times {scale:g}", _scaled(scale)) for scale in _SCALES),
        _liar("sign flipped", turned),
        _liar("Fz sign flipped", turned | {"channels": (2,)}),
        _liar("Fx and Fz swapped", _swapped(0, 2)),
        _liar("Fx and Fy, Tx and Ty swapped", _swapped(0, 1), _swapped(3, 4)),
        _liar("forces and torques swapped", _swapped(0, 3), _swapped(1, 4), _swapped(2, 5)),
    ]
    for name, port in (("force", force), ("encoder", joints)):
        lag = {"kind": "lag", "time_s": _MS_EACH_SECOND} | port
        made.append(_liar(f"{name} later by 1 ms a second", lag))
        made.append(_liar(f"{name} later by 1 ms a second, new times", lag | {"honest": False}))
    turn = {"kind": "offset"} | joints
    made += [
        _liar("encoder 2 off by a turn", turn | {"magnitude": tau, "channels": (1,)}),
        _liar("encoder 6 off by a turn back", turn | {"magnitude": -tau, "channels": (5,)}),
        _liar("force times 0.5 and 1 ms a second later", _scaled(0.5), {"kind": "lag", "time_s": 1e-3} | force),
        _liar("sign flipped and times 0.1", turned, _scaled(0.1)),
        _liar("dead with its own noise, encoder 6 off by a turn", frozen, turn | {"magnitude": tau, "channels": (5,)},
              noise_share=1.0),
        _liar("dead with its own noise, encoder 3 drifts 2 mrad/s", frozen,
              {"kind": "bias-drift", "magnitude": 2e-3, "channels": (2,)} | joints, noise_share=1.0),
        _liar("force times 0.1, encoder 3 drifts 2 mrad/s", _scaled(0.1),
              {"kind": "bias-drift", "magnitude": 2e-3, "channels": (2,)} | joints),
        _liar("Fz frozen, Fx and Fy swapped", frozen | {"channels": (2,)}, _swapped(0, 1)),
        _liar("dishonest repeat of 1 s, times 0.5", repeated | {"span_ticks": 140}, _scaled(0.5)),
    ]  # fmt: skip
    second, late = repeated | {"span_ticks": 140}, {"kind": "lag", "honest": False} | force
    made += [
        _liar(f"{name}, fresh noise", *plans, noise_share=share)
        for name, share, plans in (
            ("dishonest repeat of 1 s", 1.0, (second,)),
            ("dishonest repeat of 1 s, times 0.3", 1.0, (second, _scaled(0.3))),
            ("dishonest repeat of 1 s, sign flipped", 1.0, (second, turned)),
            ("dishonest repeat of 0.1 s", 1.0, (repeated,)),
            ("force times 0.01", 1.0, (_scaled(0.01),)),
            ("force times 0.1", 1.0, (_scaled(0.1),)),
            ("dead with three times its noise", 3.0, (frozen,)),
        )
    ]
    made += [
        _liar("force later by 0.2 s a second, new times", late | {"time_s": 0.2}),
        _liar("torques times 0.1", *(_scaled(0.1) | {"channels": (k,)} for k in (3, 4, 5))),
    ]
    back = {"kind": "delay", "honest": False} | force
    made += [
        _liar(
            f"back by {ticks / CONTROL_RATE_HZ:g} s at once, fresh noise",
            back | {"delay_ticks": ticks},
            noise_share=1.0,
        )
        for ticks in (21, 42, 70)
    ]
    return made


def _liar(name: str, *plans: Mapping[str, Any], noise_share: float = 0.0) -> Variant:
    return Variant(f"liar: {name}", plans, None, hidden=True, noise_share=noise_share)


def _scaled(factor: float) -> dict[str, Any]:
    return {"kind": "unit", "port": "force_sensor", "factor": factor}


def _swapped(one: int, other: int) -> dict[str, Any]:
    return {"kind": "swap", "port": "force_sensor", "channels": (one, other)}
