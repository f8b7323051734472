"""Emulated devices that speak the byte and frame protocols of the real ones."""
