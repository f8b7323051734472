"""Forward and backward messages over many trials at once: the expectation step.

A model says how a message goes through one action; what is common to all is said here: the scaling, the ends of trials
of different lengths, the posterior of the hidden states. Sums run in one order on every processor: no BLAS.
"""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from palpate.core.policy.belief import Floats, logarithm
from palpate.core.policy.hmm.recorded import Batch, Numbers

LEAST: Final = 1e-12
"""No reading is taken for less likely than this: a trial that a model holds for impossible must not end the fit."""


class Chain(Protocol):
    """How messages go through a model; rows are trials, columns the states that a reading leaves."""

    def first(self, symbols: Numbers) -> Floats:
        """Probability of the first reading with each state, (trials, states)."""

    def forward(self, before: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Probability of the next reading with each state after it, (trials, states)."""

    def backward(self, after: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Probability of the next reading and all that follows, from each state before it, (trials, states)."""

    def goal(self, actions: Numbers) -> Floats:
        """Probability that the action leads to the goal, from each state, (trials, states)."""


class Counts(Protocol):
    """Takes in posteriors, time by time, the last first."""

    def state(self, time: int, posterior: Floats) -> None:
        """Of the trials that have a reading then: probability of each state, times the weight, (trials, states)."""

    def move(self, time: int, before: Floats, after: Floats) -> None:
        """Of the trials that have another reading afterwards, the two messages about a move.

        Args:
            before: What came before, times the weight and over the probability of the trial, (trials, states).
            after: What comes after, the next reading not yet included, (trials, states).
        """


@dataclass(frozen=True, slots=True)
class Passed:
    """Forward messages of a batch.

    Attributes:
        messages: At each time the probability of the states by all that was read so far, (running trials, states).
        log_likelihood: Of each trial, its arrival at the goal included, (trials,).
    """

    messages: list[Floats]
    log_likelihood: Floats


def forward(batch: Batch, chain: Chain) -> Passed:
    """Forward messages of all trials."""
    messages: list[Floats] = []
    scales = np.ones(batch.symbols.shape)
    for time, running in enumerate(batch.running):
        if time == 0:
            message = chain.first(batch.symbols[:, 0])
        else:
            rows = slice(0, running)
            message = chain.forward(messages[-1][rows], batch.actions[rows, time - 1], batch.symbols[rows, time])
        scale = message.sum(axis=1)
        scales[:running, time] = np.maximum(scale, LEAST)
        message[scale < LEAST] = 1.0  # lost: anywhere
        scale = message.sum(axis=1)
        messages.append(message / scale[:, None])
    last = _last(messages, batch)
    ends = np.where(batch.reached, (last * _goals(batch, chain)).sum(axis=1), 1.0)
    return Passed(messages, logarithm(scales).sum(axis=1) + logarithm(np.maximum(ends, LEAST)))


def expect(batch: Batch, chain: Chain, counts: Counts) -> float:
    """One expectation step; gives the log-likelihood of all trials."""
    passed = forward(batch, chain)
    goals = _goals(batch, chain)
    after = np.empty((0, goals.shape[1]))
    for time in range(len(batch.running) - 1, -1, -1):
        running, longer = batch.running[time], len(after)
        message, weights = passed.messages[time], batch.weights[:running]
        ends = np.where(batch.reached[longer:running, None], goals[longer:running], 1.0)
        here = ends
        if longer:
            rows = slice(0, longer)
            moved = chain.backward(after, batch.actions[rows, time], batch.symbols[rows, time + 1])
            here = np.concatenate((moved, ends))
        joint = message * here
        share = (weights / np.maximum(joint.sum(axis=1), LEAST * LEAST)).astype(joint.dtype)
        counts.state(time, joint * share[:, None])
        if longer:
            counts.move(time, message[:longer] * share[:longer, None], after)
        after = here / np.maximum(here.max(axis=1, keepdims=True), LEAST * LEAST)
    return float((passed.log_likelihood * batch.weights).sum())


def _last(messages: list[Floats], batch: Batch) -> Floats:
    return np.stack([messages[length - 1][row] for row, length in enumerate(batch.lengths)])


def _goals(batch: Batch, chain: Chain) -> Floats:
    return chain.goal(batch.actions[np.arange(len(batch.lengths)), batch.lengths - 1])


def sums_by(keys: Numbers, rows: Floats, groups: int) -> Floats:
    """Sum of the rows that have each key, (groups, ...), in the rows' order."""
    order = np.argsort(keys, kind="stable")
    present, begins = np.unique(keys[order], return_index=True)
    result = np.zeros((groups, *rows.shape[1:]))
    if len(present):
        result[present] = np.add.reduceat(rows[order], begins, axis=0)
    return result
