"""The MuJoCo model of arm, peg and plate, and its contact geometry."""
