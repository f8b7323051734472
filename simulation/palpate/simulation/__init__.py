"""Simulated work cell, emulated devices and grid worlds."""
