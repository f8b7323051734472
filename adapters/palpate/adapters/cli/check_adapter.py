"""``palpate check-adapter``."""

from __future__ import annotations

import sys

from palpate.adapters.checking import check
from palpate.adapters.cli.options import CheckAdapterOptions
from palpate.core.contracts import Outcome


def check_adapter(options: CheckAdapterOptions) -> int:
    """Try the contract and print clause by clause; 0 if every clause that applies is kept, else 1."""
    port, results = check(options.adapter)
    sys.stdout.write(f"{options.adapter}: the contract of {port}, {len(results)} clauses\n")
    width = max(len(outcome.value) for outcome in Outcome)
    for result in results:
        sys.stdout.write(f"  {result.outcome.value:{width}}  {result.clause.statement}\n")
        if result.outcome is not Outcome.PASSED:
            sys.stdout.write(f"  {'':{width}}    {result.message}\n")
    counts = {outcome: sum(result.outcome is outcome for result in results) for outcome in Outcome}
    sys.stdout.write(", ".join(f"{count} {outcome.value}" for outcome, count in counts.items()) + "\n")
    return 1 if counts[Outcome.FAILED] else 0
