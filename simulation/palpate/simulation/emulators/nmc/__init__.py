"""The NMC bus and its servo modules, seen from the wire."""
