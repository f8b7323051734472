"""Automata: machines as values, how they are inferred from strings, and what they are compared with."""
