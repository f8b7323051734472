"""What ``python -m benchmarks.fuzz_guided`` feeds, and the tests of its corpora."""
