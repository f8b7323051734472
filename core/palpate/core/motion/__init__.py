"""Arms, kinematics, motion laws, and the way from a tip velocity to a joint command."""
