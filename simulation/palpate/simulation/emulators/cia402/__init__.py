"""CiA 402 drives, seen from the wire."""
