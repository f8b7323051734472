"""An arm and a force sensor over TCP: a whole rig that is none of palpate's own."""
