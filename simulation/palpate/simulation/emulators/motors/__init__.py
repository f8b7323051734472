"""Motors under the emulated drives: of the simulated cell, or direct."""
