"""The simulated work cell."""
