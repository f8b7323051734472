"""Pseudo-terminals, slcan adapters and virtual CAN, with line timing and fault knobs."""
