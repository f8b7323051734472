"""The memory file: what a learner of hidden states or of pasts has learned, as JSON with schema ``palpate.memory/1``.

Beside the models stand the trials that they were fitted to, from which learning can go on, and the world that they are
of: a map, or a task. A file is of one alphabet, one action set and one world, and serves no other.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeAlias

import numpy as np

from palpate.core.errors import ConfigurationError, require_in, require_whole
from palpate.core.policy.base import Action
from palpate.core.policy.belief import Floats
from palpate.core.policy.memory.automaton_model import AutomatonModel
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.learner import AUTOMATON, CLONES, OFFSET, MemoryLearner, MemoryParameters, WorldModel
from palpate.core.policy.memory.offset_model import OffsetModel, lattice_steps
from palpate.core.policy.memory.pairs import LONGEST, PAIRS, PairsLearner
from palpate.core.ports import OneOf, Settings, fitted, load_json, parse_json, require_keys, require_names, write_whole

MEMORY_SCHEMA: Final = "palpate.memory/1"
_WHOLE: Final = "memory file"
_MM: Final = 1e-3
_TABLES: Final = {
    OFFSET: ("offsets", "start", "blocked", "emissions"),
    CLONES: ("clones", "start", "transitions", "goal"),
    AUTOMATON: ("symbol_of", "start", "targets", "shares", "jumps"),
}
_MISREAD: Final = "misread"  # of clones, where readings are wrong

AnyLearner: TypeAlias = MemoryLearner | PairsLearner


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryDocument(Settings):
    """The content of a memory file."""

    TABLE: ClassVar[str] = _WHOLE

    schema: Annotated[str, OneOf(MEMORY_SCHEMA)] = MEMORY_SCHEMA
    """Id of the file format."""
    kind: Annotated[str, OneOf(*_TABLES, PAIRS)]
    """Kind of learner."""
    created_with: Mapping[str, Any]
    """Versions of what made it; for readers."""
    world: Mapping[str, Any]
    """What it was learned in; opaque here."""
    symbols: tuple[str, ...]
    """Names of the symbols."""
    actions: tuple[str, ...]
    """Names of the actions."""
    displacements_mm: tuple[tuple[float, float], ...]
    """XY displacement of each action, (actions, 2)."""
    parameters: Mapping[str, Any]
    """Settings of the learner."""
    models: tuple[Mapping[str, Any], ...]
    """The models, the best one first: their tables by name."""
    state: Mapping[str, Any]
    """State of the learner: the trials, and the tables of pasts."""

    @classmethod
    def of(cls, learner: AnyLearner, *, created_with: Mapping[str, Any], world: Mapping[str, Any]) -> MemoryDocument:
        """What a live learner has learned."""
        if isinstance(learner, MemoryLearner):
            kind, parameters, models = learner.parameters.kind, asdict(learner.parameters), learner.as_frozen().models
        else:
            kind, parameters, models = PAIRS, {"longest": learner.longest, "returned": learner.returned}, ()
        tables = [{name: _plain(getattr(model, name)) for name in _TABLES[kind]} for model in models]
        for table, model in zip(tables, models, strict=True):
            if misread := getattr(model, _MISREAD, 0.0):
                table[_MISREAD] = misread
        return cls(
            kind=kind,
            created_with=created_with,
            world=world,
            symbols=learner.states,
            actions=tuple(action.name for action in learner.actions),
            displacements_mm=tuple((x / _MM, y / _MM) for x, y in (one.displacement_m for one in learner.actions)),
            parameters=parameters,
            models=tuple(tables),
            state=learner.get_state(),
        )

    def to_json_text(self) -> str:
        """The text of the file, a line for each of its parts; floats read back exactly."""
        parts = {one.name: getattr(self, one.name) for one in fields(self)}
        lines = [f" {json.dumps(name)}: {json.dumps(part, allow_nan=False)}" for name, part in parts.items()]
        return "{\n" + ",\n".join(lines) + "\n}\n"

    @classmethod
    def from_json_text(cls, text: str) -> MemoryDocument:
        """Read the text of a file.

        Raises:
            ConfigurationError: It is no memory file, or contradicts itself.
        """
        read = cls.read(parse_json(text, _WHOLE, MEMORY_SCHEMA))
        require_names("symbols", read.symbols)
        require_names("actions", read.actions)
        if len(read.displacements_mm) != len(read.actions):
            accepted = f"{len(read.actions)}, one an action"
            raise ConfigurationError("displacements_mm", len(read.displacements_mm), accepted)
        read.learner()
        return read

    def save(self, path: str | Path) -> None:
        """Write the file as a whole or not at all.

        Raises:
            OutputError: The place cannot be written.
        """
        write_whole(Path(path), self.to_json_text())

    @classmethod
    def load(cls, path: str | Path) -> MemoryDocument:
        """Read a file.

        Raises:
            ConfigurationError: It cannot be read, or :meth:`from_json_text` refuses it.
        """
        return load_json(path, _WHOLE, cls.from_json_text)

    def world_models(self) -> tuple[WorldModel, ...]:
        """The models.

        Raises:
            ConfigurationError: Tables that are missing, or do not fit together.
        """
        models = []
        for number, raw in enumerate(self.models):
            where = f"models[{number}]"
            require_keys(where, raw, _TABLES[self.kind], (_MISREAD,) if self.kind == CLONES else ())
            read = {OFFSET: self._offsets, CLONES: self._clones, AUTOMATON: self._automaton}[self.kind]
            models.append(read(where, raw))
        return tuple(models)

    def _automaton(self, where: str, raw: Mapping[str, Any]) -> WorldModel:
        symbol_of, start, targets, shares, jumps = (
            _array(f"{where}.{name}", raw[name], size)
            for name, size in zip(_TABLES[AUTOMATON], (1, 1, 3, 3, 2), strict=True)
        )
        for name, values in (("symbol_of", symbol_of), ("targets", targets)):
            if (values % 1.0).any():
                raise ConfigurationError(f"{where}.{name}", float(values[values % 1.0 != 0.0][0]), "whole numbers")
        return AutomatonModel(symbol_of.astype(np.intp), start, targets.astype(np.intp), shares, jumps)

    def _offsets(self, where: str, raw: Mapping[str, Any]) -> WorldModel:
        offsets = fitted(f"{where}.offsets", raw["offsets"], tuple[tuple[int, int], ...])
        tables = (
            _array(f"{where}.{name}", raw[name], size)
            for name, size in zip(_TABLES[OFFSET][1:], (1, 2, 2), strict=True)
        )
        lattice = MemoryParameters.read(self.parameters, "parameters").lattice
        return OffsetModel(lattice_steps(self._action_set(), lattice), offsets, *tables)

    def _clones(self, where: str, raw: Mapping[str, Any]) -> WorldModel:
        clones = fitted(f"{where}.clones", raw["clones"], tuple[int, ...])
        start, transitions, goal = (
            _array(f"{where}.{name}", raw[name], size)
            for name, size in zip(_TABLES[CLONES][1:], (1, 3, 2), strict=True)
        )
        misread = fitted(f"{where}.{_MISREAD}", raw.get(_MISREAD, 0.0), float)
        require_in(f"{where}.{_MISREAD}", misread, 0.0, 1.0)
        return CloneModel(clones, len(self.symbols), start, transitions, goal, misread=misread)

    def _action_set(self) -> tuple[Action, ...]:
        lengths = ((x * _MM, y * _MM) for x, y in self.displacements_mm)
        return tuple(Action(name, length) for name, length in zip(self.actions, lengths, strict=True))

    def learner(self, *, frozen: bool = True) -> AnyLearner:
        """The learner that has learned this.

        Raises:
            ConfigurationError: Its tables are no models of these symbols and actions.
        """
        if self.kind == PAIRS:
            # Files without settings are of those who looked back on four readings and went by the next values alone.
            longest = fitted("parameters.longest", self.parameters.get("longest", LONGEST), int)
            returned = fitted("parameters.returned", self.parameters.get("returned", 0.0), float)
            require_whole("parameters.longest", longest, 1, 100)
            require_in("parameters.returned", returned, 0.0, 1.0)
            pairs = PairsLearner(self.symbols, self._action_set(), longest=longest, returned=returned, frozen=frozen)
            pairs.set_state(self.state)
            return pairs
        parameters = MemoryParameters.read(self.parameters, "parameters")
        learner = MemoryLearner(self.symbols, self._action_set(), parameters, frozen=frozen)
        learner.set_state(self.state)
        models = self.world_models()
        for number, model in enumerate(models):
            world = model.pomdp()
            if (world.symbols, world.actions) != (len(self.symbols), len(self.actions)):
                accepted = f"one of {len(self.symbols)} symbols and {len(self.actions)} actions"
                raise ConfigurationError(f"models[{number}]", f"{world.symbols} and {world.actions}", accepted)
        if models:
            learner.use(models, learner.trials)
        return learner


def is_memory_file(path: Path) -> bool:
    """Whether a file says of itself that it is one; one that cannot be read does not."""
    try:
        with path.open("rb") as stream:
            return MEMORY_SCHEMA.encode() in stream.read(200)
    except OSError:
        return False


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else [list(v) if isinstance(v, tuple) else v for v in value]


def _array(where: str, raw: object, sides: int) -> Floats:
    try:
        values = np.array(raw, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(
            where, "rows that differ in length or hold no numbers", f"{sides} sides of numbers"
        ) from error
    if values.ndim != sides or not np.isfinite(values).all():
        raise ConfigurationError(where, f"{values.ndim} sides", f"{sides} sides of finite numbers")
    return values
