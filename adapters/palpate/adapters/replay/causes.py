"""Known differences from the time of a recording, which may explain an unequal replay."""

import json

from palpate.adapters.log import TrialLog, arm_sha256, core_sha256, decisive, made_with, processor
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.core.policy import ForeignPolicy, PolicyDocument


def known_causes(log: TrialLog, rebuilt: Rebuilt) -> tuple[str, ...]:
    """Return the differences from the time of the recording that the log shows."""
    start, causes = log.start, []
    recorded: dict[str, str] = json.loads(start.versions_json or "{}")
    for name, version in made_with().items():
        if recorded.get(name) != version:
            causes.append(f"{name} {version} (recorded with {recorded.get(name)})")
    if start.core_sha256 != core_sha256():
        causes.append("the core's code is not the one that recorded")
    if start.model_sha256 != arm_sha256(rebuilt.config.arm, rebuilt.config.tool.geometry):
        causes.append(f"the model of the arm {rebuilt.config.arm} is not the one that recorded")
    if isinstance(rebuilt.policy, ForeignPolicy):
        told = PolicyDocument.from_json_text(start.policy_json).foreign if start.policy_json else None
        now = rebuilt.policy.entry
        if told is not None and told.code == now.code and told.source_sha256 != now.source_sha256:
            causes.append(f"the code of {now.code} is not the one that recorded")
        if told is not None and told.version != now.version:
            causes.append(f"{now.distribution} {now.version} (recorded with {told.version})")
    if other_processor(log):
        causes.append("another processor")
    return tuple(causes)


def other_processor(log: TrialLog) -> bool:
    """Return whether the recording processor may compute other last bits than this one."""
    return decisive(json.loads(log.start.processor_json or "{}")) != decisive(processor())
