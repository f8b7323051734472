"""A policy that prompts a person on the terminal for each action; its trials replay exactly.

From the repository's root::

    palpate run --policy examples.ask_a_person:Person --trials 3 --out runs/person
    palpate replay runs/person
    palpate train --learning.examples runs/person/decisions.csv --out runs/from-person

The simulator pauses until a key is pressed. The decisions have the source "person", and a replay reads them from the
log. On a rig, a choice may take at most 0.2 s, so use this policy only in the simulator.
"""

from __future__ import annotations

import os
import signal
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from palpate.core.policy import PERSON, Decision, Observation, Policy, PolicyContext, Transition

STEPS = {"w": "+x", "x": "-x", "d": "+y", "a": "-y", "e": "+x+y", "q": "+x-y", "c": "-x+y", "z": "-x-y"}
"""Step for each key, as seen from behind the arm: +x points away from the arm, +y to the right."""
ENDING = ("", "\x03", "\x04", "\x1b")
"""Keys that end the run: end of input, Ctrl-C, Ctrl-D and Escape."""


class Person(Policy):
    """A policy that asks a person to choose each action."""

    def __init__(self, context: PolicyContext) -> None:
        self._states, self._actions = context.states, context.actions
        self._indices = {action.name: index for index, action in enumerate(context.actions)}

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        say("\nq w e / a d / z x c: a step, up is +x, right is +y; Escape: end\n")

    def choose(self, observation: Observation) -> Decision:
        x_mm, y_mm = (1e3 * value for value in observation.reference_m[:2])
        tx_mNm, ty_mNm = (1e3 * value for value in observation.torque_Nm[:2])
        state = self._states[observation.state]
        say(f"x {x_mm:+.1f} y {y_mm:+.1f} mm, torque {tx_mNm:+.0f} {ty_mNm:+.0f} mN m, {state}: ")
        index = self._requested()
        say(f"{self._actions[index].name}\n")
        return Decision(self._actions[index], index, PERSON)

    def learn(self, transition: Transition) -> None:
        """Do nothing, because this policy does not learn."""

    def _requested(self) -> int:
        with single_keys():
            while (key := os.read(sys.stdin.fileno(), 1).decode("latin-1")) not in ENDING:
                if (index := self._indices.get(STEPS.get(key, ""))) is not None:
                    return index
        # The run then ends at the next tick, so this action does not matter.
        signal.raise_signal(signal.SIGINT)
        return 0


@contextmanager
def single_keys() -> Iterator[None]:
    """Read single keys from the terminal without Enter; Ctrl-C is read as a key."""
    fd = sys.stdin.fileno()
    if not os.isatty(fd):
        yield
        return
    before = termios.tcgetattr(fd)
    try:
        tty.setraw(fd, termios.TCSANOW)
        yield
    finally:
        termios.tcsetattr(fd, termios.TCSANOW, before)


def say(text: str) -> None:
    """Write text to the terminal immediately."""
    sys.stderr.write(text)
    sys.stderr.flush()
