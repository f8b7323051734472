"""The work cell in MuJoCo behind the ports, and how it is drawn."""
