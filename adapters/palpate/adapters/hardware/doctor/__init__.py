"""``palpate doctor``: what is to be said about the devices of a rig, and how to mend what is wrong."""
