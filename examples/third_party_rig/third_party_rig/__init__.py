"""A complete third-party rig for palpate, with an arm and a force sensor over TCP."""
