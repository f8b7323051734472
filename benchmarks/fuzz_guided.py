"""Coverage-guided fuzzing of drivers: the NMC arm, CiA 402 drives, and the JR3 codec on CAN.

    python -m benchmarks.fuzz_guided --target nmc --seconds 600
    python -m benchmarks.fuzz_guided --target cia402 --seconds 600 --corpus DIR

This needs atheris, which is not a dependency of the project (``pip install atheris``). New inputs go to the folder
given by ``--corpus`` or to a temporary folder; the small corpora in tests/fuzz are only read. A failure ends the run
with a traceback and saves the input in a file named crash-*.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from importlib import import_module
from pathlib import Path

from benchmarks.fuzzing import CORPORA

TARGETS = {"nmc": (4096, "-timeout=20"), "cia402": (256,), "jr3": (256,)}
"""Maximum input length in bytes, and further libFuzzer arguments."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", choices=TARGETS, required=True)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--corpus", type=Path, help="where new inputs go")
    options = parser.parse_args()
    import atheris  # type: ignore[import-not-found, unused-ignore]

    longest, *limits = TARGETS[options.target]
    with atheris.instrument_imports(include=["palpate.drivers"]):
        once = import_module(f"benchmarks.fuzz_targets.{options.target}").once
    corpus = CORPORA / {"jr3": "jr3_can"}.get(options.target, options.target)
    with tempfile.TemporaryDirectory() as scratch:
        words = [f"-max_total_time={options.seconds}", f"-max_len={longest}", "-print_final_stats=1", *limits]
        folders = [str(options.corpus or Path(scratch)), str(corpus)]
        atheris.Setup([sys.argv[0], *folders, *words], lambda data: once(data) and None)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
