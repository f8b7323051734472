"""Recorded trials fed back through the unmodified core, and every output held against what was recorded."""
