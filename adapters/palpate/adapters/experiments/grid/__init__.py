"""Learning in grid worlds: runs over seeds, their tables, files and pictures."""
