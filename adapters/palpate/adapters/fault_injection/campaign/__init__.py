"""The fault campaign: trials in which something goes wrong on purpose, and what came of each."""
