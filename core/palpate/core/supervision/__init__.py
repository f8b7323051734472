"""The contact supervisor: watches every tick, clamps or trips, and lets no trial begin before a person acknowledges."""
