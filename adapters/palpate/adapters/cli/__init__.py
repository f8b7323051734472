"""The ``palpate`` command, with one module per subcommand."""
