"""How often intervals that say 95 % hold: ours beside the bootstrap, by simulation.

``python -m benchmarks.intervals``: for each number of trials, 10 000 samples (2000 of them with a bootstrap) of times
that are exponential, log-normal, or cut off by a time limit as those of failed trials are, and of successes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from scipy.stats import bootstrap

from palpate.adapters.experiments.statistics import LEVEL, quantile_interval, t_half_width, wilson_interval

COUNTS = (5, 10, 20, 50, 100, 150)
Draw = Callable[[np.random.Generator, tuple[int, int]], np.ndarray]
LIMIT_S = 20.0
TIMES: dict[str, tuple[Draw, Callable[[float], float]]] = {
    "exponential": (lambda rng, shape: rng.exponential(1.0, shape), lambda q: -np.log1p(-q)),
    "log-normal": (lambda rng, shape: rng.lognormal(0.0, 1.0, shape), lambda q: {0.5: 1.0, 0.95: 5.1802516}[q]),
    "cut off at a limit": (
        lambda rng, shape: np.minimum(rng.exponential(8.0, shape), LIMIT_S),
        lambda q: min(-8.0 * np.log1p(-q), LIMIT_S),
    ),
}


def of_quantile(samples: np.ndarray, quantile: float, true: float) -> float | None:
    """Share of the samples whose interval holds the true quantile; None where no interval is stated."""
    # Which of the sorted values are the ends depends on their number alone.
    ranks = quantile_interval(list(range(samples.shape[1])), quantile)
    if ranks is None:
        return None
    ordered = np.sort(samples, axis=1)
    low, high = (ordered[:, int(rank)] for rank in ranks)
    return float(np.mean((low <= true) & (true <= high)))


def of_bootstrap(samples: np.ndarray, quantile: float, true: float) -> float:
    """The same of the percentile bootstrap."""
    found = bootstrap(
        (samples,), lambda x, axis: np.quantile(x, quantile, axis=axis), axis=1, n_resamples=999, batch=50,
        confidence_level=LEVEL, method="percentile", rng=np.random.default_rng(0), vectorized=True,
    ).confidence_interval  # fmt: skip
    return float(np.mean((found.low <= true) & (true <= found.high)))


def shown(share: float | None) -> str:
    return "none stated" if share is None else f"{share:.1%}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--bootstrapped", type=int, default=2000)
    options = parser.parse_args()
    print("| trials | times | median, order statistics | bootstrap | 95th percentile, order statistics | bootstrap |")
    print("|---|---|---|---|---|---|")
    for count in COUNTS:
        for name, (draw, true_of) in TIMES.items():
            samples = draw(np.random.default_rng(count), (options.samples, count))
            cells = []
            for quantile in (0.5, 0.95):
                true = true_of(quantile)
                cells += [
                    shown(of_quantile(samples, quantile, true)),
                    shown(of_bootstrap(samples[: options.bootstrapped], quantile, true)),
                ]
            print(f"| {count} | {name} | {' | '.join(cells)} |", flush=True)
    print("\n| trials | Wilson, success 0.5 | 0.9 | 0.99 | t of a mean, normal | t of a mean, exponential |")
    print("|---|---|---|---|---|---|")
    for count in COUNTS:
        cells = []
        for success in (0.5, 0.9, 0.99):
            holds = [low <= success <= high for low, high in (wilson_interval(k, count) for k in range(count + 1))]
            drawn = np.random.default_rng(count).binomial(count, success, options.samples)
            cells.append(float(np.mean(np.array(holds)[drawn])))
        for draw, mean in ((np.random.Generator.standard_normal, 0.0), (np.random.Generator.standard_exponential, 1.0)):
            values = draw(np.random.default_rng(count), (count, options.samples))
            cells.append(float(np.mean(np.abs(values.mean(axis=0) - mean) <= t_half_width(values))))
        print(f"| {count} | {' | '.join(map(shown, cells))} |")


if __name__ == "__main__":
    main()
