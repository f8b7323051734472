"""All benchmarks through one entry point: ``python -m benchmarks.suite --help``."""
