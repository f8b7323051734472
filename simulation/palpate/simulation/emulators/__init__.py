"""Emulated devices that use the byte and frame protocols of the real ones."""
