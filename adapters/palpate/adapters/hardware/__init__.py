"""Rigs of real devices: adapters of the drivers, watchdogs, real time, the doctor, and the emulated cell."""
