"""Do the tests guard after a change of the house what they guarded before? See ``benchmarks.mutants.__main__``."""
