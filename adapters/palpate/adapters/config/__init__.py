"""All settings: of a run, of a rig, of real time; and their TOML form."""
