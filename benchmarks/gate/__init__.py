"""Mutants of the core against the golden logs and the unit tests: ``python -m benchmarks.gate --help``."""
