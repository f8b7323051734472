"""Studies: many runs over configurations, policies and seeds, each finished once, on any number of processes."""
