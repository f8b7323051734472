"""Seeds of a benchmark in several processes, each one line of JSON; a file that has some already is gone on with."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Hashable, Mapping
from multiprocessing import Pool
from pathlib import Path
from typing import Any


def run_seeds(description: str | None, run: Callable[[int], Any], first_seed: int) -> tuple[list[Any], Path | None]:
    """Run what the command line asks for.

    Args:
        run: What one seed gives, a JSON object with its ``seed``.

    Returns:
        The results of all seeds in the file, and where a picture of them goes, if anywhere.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=first_seed)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    seeds = {seed: seed for seed in range(options.first_seed, options.first_seed + options.seeds)}
    return gone_on_with(options.out, options.jobs, run, seeds, lambda result: result["seed"]), options.picture


def gone_on_with(
    path: Path, processes: int, run: Callable[[Any], Any], jobs: Mapping[Hashable, Any], key: Callable[[Any], Hashable]
) -> list[Any]:
    """Run the jobs whose results a file lacks, each one line of JSON there as soon as it is done.

    Args:
        jobs: What ``run`` takes, by what is told of it by the key of its result.

    Returns:
        All results in the file.
    """
    done = [json.loads(text) for text in path.read_text().splitlines()] if path.exists() else []
    known = set(map(key, done))
    with Pool(processes) as pool, path.open("a") as file:
        for result in pool.imap_unordered(run, [job for name, job in jobs.items() if name not in known]):
            done.append(result)
            file.write(json.dumps(result) + "\n")
            file.flush()
    return done
