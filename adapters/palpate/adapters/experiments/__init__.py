"""Trials, training, evaluation and studies: from a configuration to scored results."""
