"""The arm of a rig file, in the loop's process or in one of its own."""

from __future__ import annotations

from dataclasses import replace

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.rig import RigFile
from palpate.adapters.hardware.bus_process import host_arm
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext, arm_maker
from palpate.adapters.hardware.real_time import join_loop

NS = 10**9
MOVING = (0, 5)
"""Joints that are moved."""
FASTEST_RAD_S = 0.5


def context_of(arm: str, clock: MonotonicClock, wishes: RealTimeConfig) -> RigContext:
    context = RigContext.of(arm, clock)
    limits = tuple(min(limit, FASTEST_RAD_S) for limit in context.velocity_limit_rad_s)
    return replace(context, velocity_limit_rad_s=limits, hurry=lambda: join_loop(wishes))


def adapter_of(rig: RigFile, arm: str, wishes: RealTimeConfig, deadman_ms: float) -> tuple[ArmAdapter, MonotonicClock]:
    """The arm of a rig file, in a process of its own unless the deadman's time is 0."""
    clock = MonotonicClock()
    context = context_of(arm, clock, wishes)
    if not deadman_ms:
        return arm_maker(rig.arm.adapter)(rig.arm.settings, context), clock
    deadman_ns = round(deadman_ms * 1e6)
    hosted = host_arm(rig.arm.adapter, rig.arm.settings, context, clock, real_time=wishes, deadman_ns=deadman_ns)
    return ArmAdapter(hosted, hosted), clock
