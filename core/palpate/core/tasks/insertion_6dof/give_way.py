"""For a round peg in a grip that leans: the torque rule, which stops now and then to give way in tilt."""

from collections.abc import Sequence
from math import atan2, hypot, pi
from typing import Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, drawing_from

_FIRST: Final = 3
_EVERY: Final = 5


class GiveWay(FixedPolicy):
    """Steps where the torque says the hole is; three actions first, and every fifth then, give way in tilt on the spot.

    A peg that leans stands on its edge, and the torque of that hides the one that points at the hole.

    Args:
        actions: Compass steps, equally spaced from +x, and the one that gives way.
        threshold_Nm: Torque below which it points nowhere.

    Raises:
        ConfigurationError: No action gives way.
    """

    def __init__(self, actions: Sequence[Action], threshold_Nm: float) -> None:
        super().__init__()
        self._steps = [index for index, action in enumerate(actions) if action.spatial is None]
        giving = [i for i, each in enumerate(actions) if each.spatial is not None and each.spatial.law is Law.GIVE_WAY]
        if not giving:
            accepted = "a policy of actions that this task has; it is one of --task insertion-6dof"
            raise ConfigurationError("policy", "give-way", accepted)
        self._actions, self._giving, self._threshold_Nm = tuple(actions), giving[0], threshold_Nm

    @override
    def choose(self, observation: Observation) -> Decision:
        """The compass step nearest to the torque's heading, or giving way."""
        index = self._giving
        since = observation.action_number - _FIRST
        if since >= 0 and since % _EVERY != _EVERY - 1:
            tx, ty, _ = observation.torque_Nm
            if hypot(tx, ty) >= self._threshold_Nm:
                heading_rad = atan2(tx, -ty)
            else:
                heading_rad = float(drawing_from(self._rng, "give-way").uniform(0.0, 2 * pi))
            index = self._steps[round(heading_rad / (2 * pi) * len(self._steps)) % len(self._steps)]
        return Decision(self._actions[index], index, "give-way")
