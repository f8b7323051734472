"""The flight recorder: decorators over the ports, and a writer that is never in the control loop's way."""
