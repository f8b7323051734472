"""The ``palpate`` command; one module per subcommand."""
