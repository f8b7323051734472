"""Emulated devices that use the byte and frame protocols of real devices."""
