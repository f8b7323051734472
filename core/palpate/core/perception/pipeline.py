"""The upper perception layers: measurement vector -> features -> symbol -> state (paper, Fig. 1)."""

from dataclasses import dataclass
from typing import Any, Final

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.features import FeatureExtractor, PrincipalComponents, SelectedChannels, SelfOrganisingMap
from palpate.core.perception.signal import Normalisation, SignalProcessor
from palpate.core.perception.situations import Situations, TaskFacts
from palpate.core.perception.state import IdentityState, LastAction, LastSymbols, StateIdentifier
from palpate.core.perception.symbols import Clusters, GatedThresholds, RandomPartition, Symboliser, Thresholds
from palpate.core.ports import CHANNELS, STAGES, Settings, kinds_of, require_keys


@dataclass(frozen=True)
class Perception:
    """The stages that map a filtered measurement vector to a state.

    Attributes:
        identifier: Stage that maps symbols to a state, and the only one that may have memory.

    Raises:
        ConfigurationError: A stage's output does not match the next stage's input.
    """

    extractor: FeatureExtractor
    symboliser: Symboliser
    identifier: StateIdentifier

    def __post_init__(self) -> None:
        _require_same("perception.symboliser.features", self.symboliser.features, self.extractor.names)
        _require_same("perception.identifier.symbols", self.identifier.symbols, self.symboliser.symbols)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Return the symbol names."""
        return self.symboliser.symbols

    @property
    def states(self) -> tuple[str, ...]:
        """Return the state names."""
        return self.identifier.states

    def reset(self) -> None:
        """Reset the state for a new trial."""
        self.identifier.reset()

    def observe(self, signal: tuple[float, ...], action: str | None = None) -> tuple[int, int]:
        """Process a measurement vector in SI units, in ``CHANNELS`` order; return the symbol and state.

        A task may append its own values after the channels.

        Args:
            action: Name of the preceding action; None at the start.

        Raises:
            CommandError: There are fewer than nine numbers, or one that is used is not finite.
        """
        if len(signal) < len(CHANNELS):
            raise CommandError(f"a measurement vector must have {len(CHANNELS)} channels", signal)
        symbol = self.symboliser.symbol(self.extractor.extract(signal))
        return symbol, self.identifier.update(symbol, action)

    def get_state(self) -> list[float]:
        """Return the identifier's state."""
        return self.identifier.get_state()


def _require_same(field: str, requested: tuple[str, ...], given: tuple[str, ...]) -> None:
    if requested != given:
        raise ConfigurationError(field, requested, f"the names that the stage before gives: {', '.join(given)}")


SCHEMA: Final = "palpate.perception/3"
_ROLES: Final = {"extractor": FeatureExtractor, "symboliser": Symboliser, "identifier": StateIdentifier}
STAGES.update(
    {
        "normalisation": Normalisation,
        "signal_processor": SignalProcessor,
        "selected_channels": SelectedChannels,
        "task_facts": TaskFacts,
        "principal_components": PrincipalComponents,
        "self_organising_map": SelfOrganisingMap,
        "thresholds": Thresholds,
        "gated_thresholds": GatedThresholds,
        "random_partition": RandomPartition,
        "clusters": Clusters,
        "situations": Situations,
        "identity": IdentityState,
        "last_symbols": LastSymbols,
        "last_action": LastAction,
    }
)


def stage_to_dict(stage: object) -> dict[str, Any]:
    """Convert a stage to plain JSON values.

    Raises:
        ConfigurationError: The stage's kind is not registered.
    """
    kind = next((kind for kind, known in STAGES.items() if type(stage) is known), None)
    if kind is None:
        raise ConfigurationError("perception.stage", stage, f"a stage of kind {', '.join(STAGES)}")
    return {"kind": kind, **{name: _plain(getattr(stage, name)) for name in kinds_of(type(stage))}}


def stage_from_dict(data: object, where: str = "perception.stage") -> Any:
    """Read the result of :func:`stage_to_dict`.

    Raises:
        ConfigurationError: The kind is unknown, keys are missing or unknown, or a value is wrong.
    """
    if not isinstance(data, dict):
        raise ConfigurationError(where, data, "a table with a 'kind'")
    kind = data.get("kind")
    known = STAGES.get(kind) if isinstance(kind, str) else None
    if known is None:
        raise ConfigurationError(f"{where}.kind", kind, f"one of {', '.join(STAGES)}")
    # A nested table is also a stage.
    values = {
        key: stage_from_dict(value, f"{where}.{key}") if isinstance(value, dict) else value
        for key, value in data.items()
        if key != "kind"
    }
    return known.read(values, where)


def perception_to_dict(perception: Perception) -> dict[str, Any]:
    """Convert a complete perception to plain JSON values, to be saved separately or within another document."""
    return {"schema": SCHEMA, **{role: stage_to_dict(getattr(perception, role)) for role in _ROLES}}


def perception_from_dict(data: object) -> Perception:
    """Read the result of :func:`perception_to_dict`.

    Raises:
        ConfigurationError: The schema differs, keys are missing or unknown, or a stage is wrong.
    """
    if not isinstance(data, dict):
        raise ConfigurationError("perception", data, f"a table with schema {SCHEMA!r}")
    if data.get("schema") != SCHEMA:
        raise ConfigurationError("perception.schema", data.get("schema"), repr(SCHEMA))
    require_keys("perception", data, ["schema", *_ROLES])
    stages: dict[str, Any] = {}
    for role, protocol in _ROLES.items():
        stages[role] = stage_from_dict(data[role], f"perception.{role}")
        if not isinstance(stages[role], protocol):
            raise ConfigurationError(f"perception.{role}.kind", data[role]["kind"], f"a kind of {role}")
    return Perception(**stages)


def _plain(value: object) -> object:
    if isinstance(value, Settings):
        return stage_to_dict(value)
    return [_plain(item) for item in value] if isinstance(value, (tuple, list)) else value
