"""Adapters between the core and its environment: ports, experiments, results and the command line."""
