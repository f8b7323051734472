"""The contact supervisor: watches every tick, clamps or trips, and lets nobody go on before a person says so."""
