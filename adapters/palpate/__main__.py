"""``python -m palpate``: the command line, if no script is installed."""

import sys

from palpate.adapters.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
