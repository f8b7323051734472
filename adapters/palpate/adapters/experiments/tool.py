"""Which peg a touch model is of: another one's torques mean something else."""

from collections.abc import Mapping
from typing import Any

from palpate.adapters.config import RunConfig
from palpate.core.errors import ConfigurationError
from palpate.core.policy import PolicyDocument
from palpate.core.ports import fitted


def tool_of(config: RunConfig) -> dict[str, Any]:
    """What of the peg decides which torque is felt where, by its settings. The clearance does not."""
    peg = config.cell.peg
    told = {"cross_section": peg.cross_section, "diameter_mm": peg.diameter_mm, "chamfer_mm": peg.chamfer_mm}
    if peg.cross_section == "rounded-square":
        told["corner_radius_mm"] = peg.corner_radius_mm
    if peg.cross_section == "keyed":
        told["flat_mm"] = peg.flat_mm
    return {f"cell.peg.{name}": value for name, value in told.items()}


def tool_in(document: PolicyDocument) -> dict[str, Any] | None:
    """The tool of a policy file's touch model; None where it has no such model, and in the policy of a log."""
    tool = signal_in(document).get("tool")
    if tool is None or document.learner is None or document.learner.kind != "belief":
        return None
    return dict(fitted("policy.perception.signal.tool", tool, Mapping[str, Any]))


def signal_in(document: PolicyDocument) -> Mapping[str, Any]:
    """How a policy file's signal is made, and with which tool."""
    found: Mapping[str, Any] = fitted(
        "policy.perception.signal", document.perception.get("signal", {}), Mapping[str, Any]
    )
    return found


def require_same_tool(document: PolicyDocument, config: RunConfig) -> None:
    """Refuse a touch model of another tool, unless it is asked for as a beginning.

    Raises:
        ConfigurationError: The run has another peg than the policy file.
    """
    learned = tool_in(document)
    if learned is None or config.learning.belief.other_tool:
        return
    for name, value in tool_of(config).items():
        if learned.get(name) != value:
            remedy = "or --learning.belief.other-tool, to begin with what another tool taught"
            raise ConfigurationError(
                name, value, f"{learned.get(name)!r}, of which the policy's touch model is ({remedy})"
            )
