"""Mutants of core, log and replay against the golden logs and the unit tests: ``python -m benchmarks.gate --help``."""
