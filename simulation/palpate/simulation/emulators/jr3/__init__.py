"""The JR3 board, seen from the wire."""
