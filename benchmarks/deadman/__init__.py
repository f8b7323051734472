"""Does the arm come to rest when the loop falls silent? See ``benchmarks.deadman.__main__``."""
