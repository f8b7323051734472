"""Training and extraction of automata, beside published ways to the same end."""

from __future__ import annotations

import importlib.util
import random
from dataclasses import replace
from statistics import mean, median
from time import process_time

from benchmarks.suite.rows import Form, MissingError, Row
from palpate.core.automata.infer import InferenceSettings, infer
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import TrainingSettings

SEED = 200
STEPS = 60
"""Steps of training that are timed beside the peer's."""
PEER_STEPS = 20


def inferred(form: Form) -> list[Row]:
    """Training beside PyTorch's own recurrent network, inference beside IoAlergia, on the same strings."""
    from benchmarks.automata_maps import extraction_ms
    from palpate.adapters.experiments.grid.worlds import grid_named
    from palpate.core.automata.elman import Architecture, Readout
    from palpate.core.automata.training import train
    from palpate.simulation.grid.trial import walk_strings

    strings = walk_strings(grid_named("1", 7), form.walks, SEED, 30)
    settings = TrainingSettings(restarts=form.restarts, seed=SEED)
    architecture = Architecture(
        alphabet=strings.alphabet, reading=Readout.PREDICTION, hidden=InferenceSettings().hidden
    )
    few = replace(settings, steps=STEPS)
    began = process_time()
    train(strings, architecture, few)
    step_us = 1e6 * (process_time() - began) / (form.restarts * few.steps)
    began = process_time()
    found = infer(strings, InferenceSettings(training=settings))
    inferred_s = process_time() - began
    rows = [
        Row("training, a step of one network", step_us, "us", "torch.nn.RNN, one at a time", rnn_step_us(strings)),
        Row("extraction at all q, a network", mean(extraction_ms(found)), "ms"),
    ]
    if importlib.util.find_spec("aalpy") is None:
        return [*rows, Row("strings to automaton", inferred_s, "s")]
    from benchmarks.automata_learners import alergia

    began = process_time()
    alergia(strings, 0.05)
    return [*rows, Row("strings to automaton", inferred_s, "s", "IoAlergia (AALpy)", process_time() - began)]


def rnn_step_us(strings: Strings) -> float:
    """CPU time of a step of Adam on PyTorch's own Elman network: packed strings, prediction of the next symbol."""
    import torch
    from torch.nn.utils.rnn import pack_sequence

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        count = len(strings.alphabet)
        words = [torch.tensor(word) for word in strings.words]
        one_hot = torch.nn.functional.one_hot
        inputs = pack_sequence([one_hot(word, count).float() for word in words], enforce_sorted=False)
        # After the last symbol comes the end, which is one more.
        ends = torch.tensor([count])
        targets = pack_sequence([torch.cat((word[1:], ends)) for word in words], enforce_sorted=False).data
        network, read = (
            torch.nn.RNN(count, InferenceSettings().hidden),
            torch.nn.Linear(InferenceSettings().hidden, count + 1),
        )
        optimiser = torch.optim.Adam([*network.parameters(), *read.parameters()], lr=0.1)
        took = []
        for _ in range(PEER_STEPS):
            began = process_time()
            optimiser.zero_grad()
            hidden, _ = network(inputs)
            torch.nn.functional.cross_entropy(read(hidden.data), targets).backward()
            optimiser.step()
            took.append(1e6 * (process_time() - began))
    finally:
        torch.set_num_threads(threads)
    return median(took)


def minimised(form: Form) -> list[Row]:
    """Minimisation and comparison beside two libraries, which must agree."""
    for library in ("aalpy", "automata"):
        if importlib.util.find_spec(library) is None:
            raise MissingError(f"{library} is not installed")
    from benchmarks.automata_others import SORTS, CrossCheck, pair

    rng, check = random.Random(1), CrossCheck()
    for index in range(form.machines // 2):
        one, other = pair(rng, SORTS[index % len(SORTS)])
        check.machine(one)
        check.machine(other)
        check.pair(one, other)
    if check.disagreements:
        raise RuntimeError(f"{len(check.disagreements)} disagreements; see benchmarks/automata_minimise.py")
    rows = []
    for task, seconds in sorted(check.seconds.items()):
        what, who = task.rsplit(", ", 1)
        if who != "palpate":
            rows.append(
                Row(
                    f"{what}, {form.machines} machines",
                    1e3 * check.seconds[f"{what}, palpate"],
                    "ms",
                    who,
                    1e3 * seconds,
                )
            )
    return rows
