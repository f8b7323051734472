"""Entry point of ``python -m palpate``, which runs the command line without an installed script."""

import sys

from palpate.adapters.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
