"""A picture of a model of offsets: which of them tells which symbol, what is blocked, where the agent may be."""

from typing import Any, Final

from palpate.adapters.log import drawing
from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats
from palpate.core.policy.memory import MemoryDocument, OffsetModel

_BLOCKED: Final = 0.5  # a side is drawn as a wall from this probability on
# Colours that differ for any colour vision (Okabe and Ito), and greys of them where a symbol is not sure.
_COLOURS: Final = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#999999")


def memory_picture(document: MemoryDocument, belief: Floats, after: str, kind: str) -> bytes:
    """Draw the model of a memory file.

    Raises:
        ConfigurationError: It has no model of offsets.
    """
    models = document.world_models()
    if not models or not isinstance(models[0], OffsetModel):
        raise ConfigurationError("file", document.kind, "one with a model of offsets; no other is laid out in space")
    model = models[0]
    with drawing(10.0, 5.2, 110, kind) as canvas:
        left, right = canvas.figure.subplots(1, 2)
        for place, (u, v) in enumerate(model.offsets):
            best = int(model.emissions[place].argmax())
            share = float(model.emissions[place, best])
            _cell(left, (u, v), _COLOURS[best % len(_COLOURS)], 0.15 + 0.65 * share, document.symbols[best])
            _cell(right, (u, v), "#0072b2", float(belief[place] / max(belief.max(), 1e-12)), _hundredths(belief[place]))
            for action, (du, dv) in enumerate(model.steps):
                if abs(du) + abs(dv) == 1 and model.blocked[action, place] >= _BLOCKED:
                    across = 0.5 * abs(dv), 0.5 * abs(du)
                    x, y = u + 0.5 * du, v + 0.5 * dv
                    left.plot((x - across[0], x + across[0]), (y - across[1], y + across[1]), color="black")
        left.set_title("most likely symbol; lines: moves that are blocked", fontsize=9)
        right.set_title(f"belief {f'after {after}' if after else 'before a trial'}, in hundredths", fontsize=9)
        for axes in (left, right):
            _cell(axes, (0, 0), "black", 0.9, "")
            axes.set_aspect("equal")
            axes.autoscale_view()
            axes.set_xlabel("from the goal along x, in steps")
    return canvas.content


def _cell(axes: Any, offset: tuple[int, int], colour: str, alpha: float, text: str) -> None:
    from matplotlib.patches import Rectangle

    u, v = offset
    axes.add_patch(Rectangle((u - 0.5, v - 0.5), 1.0, 1.0, facecolor=colour, alpha=alpha, edgecolor="white"))
    axes.text(u, v, text, ha="center", va="center", fontsize=7)


def _hundredths(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.005 else ""
