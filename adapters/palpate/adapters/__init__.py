"""What connects the core to the world: ports over MuJoCo and fakes, experiments, results, the command line."""
