"""A memory file as text: what was learned, and a map of which offsets from the goal tell which symbol."""

from collections.abc import Sequence
from string import ascii_uppercase

from palpate.adapters.log import aligned
from palpate.core.errors import ConfigurationError
from palpate.core.policy import MemoryEntry, PolicyDocument
from palpate.core.policy.belief import Floats
from palpate.core.policy.memory import (
    AutomatonModel,
    CloneModel,
    MemoryDocument,
    OffsetModel,
    PairsLearner,
    StateBelief,
)

_SURE = 0.9


def policy_memory(policy: PolicyDocument, memory: MemoryEntry) -> MemoryDocument:
    """What a policy file has learned of hidden states, as a memory file has it: the models are fitted for it."""
    learner = memory.learner(policy.states, [action.step() for action in policy.actions], frozen=True)
    return MemoryDocument.of(learner, created_with=policy.created_with, world={})


def render_memory(document: MemoryDocument, after: str = "") -> str:
    """Kind, sizes and trials of a memory file; of the best model, what is known of each offset, and the belief.

    Args:
        after: Symbols and actions in turns, such as ``A +x B``: the belief after them; else that before a trial.

    Raises:
        ConfigurationError: ``after`` has other symbols and actions, or there is no model.
    """
    learner = document.learner()
    head = f"{document.kind}: {len(document.symbols)} symbols, {len(document.actions)} actions; "
    head += f"{learner.trials_learned} trials learned\n"
    if isinstance(learner, PairsLearner):
        return head + f"{learner.pasts} pasts of one to {learner.longest} symbols\n"
    if not learner.models:
        return head + "no model yet: it is fitted after the first trials\n"
    lines = [head]
    for number, model in enumerate(learner.models):
        sizes = f"{model.pomdp().states} hidden states, {model.log_loss(learner.trials):.3f} nats a reading"
        lines.append(f"model {number}: {sizes}\n")
    best, belief = learner.models[0], believed(document, after)
    if isinstance(best, OffsetModel):
        short = labels(document.symbols)
        lines.append("\nwhich symbol is read where, from the goal (small: less than nine times in ten)\n")
        if short != document.symbols:
            lines.append(", ".join(f"{each} {name}" for each, name in zip(short, document.symbols, strict=True)) + "\n")
        lines.append(_laid_out(best, [_told(short, row) for row in best.emissions]))
        lines.append(f"\nbelief {f'after {after}' if after else 'before a trial'}, in hundredths\n")
        lines.append(_laid_out(best, [f"{100 * share:.0f}" if share >= 0.005 else "-" for share in belief]))
    elif isinstance(best, CloneModel | AutomatonModel):
        world, rows = best.pomdp(), [("symbol", "hidden states", "belief")]
        for number, name in enumerate(document.symbols):
            mine = world.emission(number)
            rows.append((name, f"{mine.sum():.0f}", f"{mine @ belief:.2f}"))
        lines.append("\n" + aligned(rows, left=1))
    return "".join(lines)


def believed(document: MemoryDocument, after: str = "") -> Floats:
    """Probability of each hidden state of the best model after symbols and actions in turns; before a trial for none.

    Raises:
        ConfigurationError: They are others than the file's, or do not take turns; or the file has no model.
    """
    models, words = document.world_models(), after.split()
    symbols, actions = ([name.replace(" ", "_") for name in names] for names in (document.symbols, document.actions))
    if not models:
        raise ConfigurationError(
            "after", after, "given for a file with a model: pairs have none, short trainings not yet"
        )
    model = models[0].pomdp()
    if not words:
        return model.start
    for place, word in enumerate(words):
        names = actions if place % 2 else symbols
        if word not in names:
            raise ConfigurationError("after", word, f"one of {' '.join(names)}, symbols and actions in turns")
    if len(words) % 2 == 0:
        raise ConfigurationError("after", after, "a symbol behind the last action")
    belief = StateBelief(model, symbols.index(words[0]))
    for action, symbol in zip(words[1::2], words[2::2], strict=True):
        belief.update(actions.index(action), symbols.index(symbol))
    return belief.probabilities


def labels(symbols: tuple[str, ...]) -> tuple[str, ...]:
    """Letters for symbols whose names are too long for a map."""
    fit = max(map(len, symbols)) <= 2 or len(symbols) > len(ascii_uppercase)
    return symbols if fit else tuple(ascii_uppercase[: len(symbols)])


def _told(symbols: Sequence[str], emission: Floats) -> str:
    best = int(emission.argmax())
    return symbols[best] if emission[best] >= _SURE else symbols[best].lower()


def _laid_out(model: OffsetModel, texts: Sequence[str]) -> str:
    """A text for each offset where it lies, v upwards; a dot for the goal."""
    at = dict(zip(model.offsets, texts, strict=True)) | {(0, 0): "·"}
    columns, rows = (range(min(side), max(side) + 1) for side in zip(*at, strict=True))
    return aligned([[at.get((u, v), " ") for u in columns] for v in reversed(rows)], left=0)
