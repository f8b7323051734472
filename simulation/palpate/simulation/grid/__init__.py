"""Grid worlds with ambiguous sensors, and what can be known about them exactly."""
