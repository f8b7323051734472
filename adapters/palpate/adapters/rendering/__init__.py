"""Pictures and films of recorded trials: what the encoders and the force sensor told, shown on a model of the cell.

No physics runs. Each picture puts the recorded joint angles into the model and draws the measured force over it.
"""
