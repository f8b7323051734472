"""Find words for which the field has a standard term, in the documents or, with --source, in source strings.

Code, addresses and file names are ignored. Words that also have a plain meaning (way, hand, over, led, gate, reach,
rig) are not checked.
"""

import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

STANDARD: Final = {
    r"told|tells|untold": "reported, prints, says, raises",
    r"mend|mends|mended|anew": "fix; again",
    r"nobody|somebody|whoever|whatever": "no one, or the real subject",
    r"beside": "next to, in addition to, compared with",
    r"held against|hold (it|them) against": "compared with, checked against",
    r"in earnest|now and then|to and fro|all round": "for real; occasionally; back and forth; on all sides",
    r"so many|so much|by so": "a number, a limit, up to",
    r"comes to|came of|come of|of before|as it comes": "results in; outcome; previous; by default",
    r"go on with|goes on with|gone on with|going on with": "resume, continue",
    r"heave|heaves|liar|liars|sign of life|in doubt": "dither; undetected sensor fault; liveness check; mismatch",
    r"borne|lean|leans|leaned|leaning|gives? way|gave way|giving way|led back": "supported; tilt; comply; moved back",
    r"at rest|stands? still|standing still": "stationary",
    r"foretells?|foretold|foresees?|reckons?|reckoned": "predict, compute",
    r"comparators?|omniscient|strange|strangers?|stranger's": "baseline; oracle; third-party",
    r"deadman|hindsight|touch model|stopwatch|blames?|blamed": "set-point time-out; episode outcome; contact model",
    r"knobs?|oddity|oddities|lately|mishaps?|films?": "parameter; diagnostics; fault scenario; video",
    r"be it|or it would": "a plain main clause",
}
"""Regular expressions of unusual words, and the standard terms to use instead."""

SKIPPED: Final = re.compile(r"^```.*?^```|`[^`]*`|\]\([^)]*\)|<!-- fields -->.*<!-- end", re.DOTALL | re.MULTILINE)
"""Blocks, code, addresses, and the table of job fields, which is generated from the declarations."""


def found(text: str) -> list[tuple[int, str, str]]:
    """Return the line number, word and standard term of every unusual word in a page."""
    plain = SKIPPED.sub(lambda match: "\n" * match.group().count("\n"), text)
    return sorted(
        (plain.count("\n", 0, match.start()) + 1, match.group(), standard)
        for words, standard in STANDARD.items()
        for match in re.finditer(rf"\b(?:{words})\b", plain, re.IGNORECASE)
    )


def strings(path: str) -> str:
    """Return the docstrings, help texts and messages of a module, each on its original line."""
    lines: list[str] = [""] * (Path(path).read_text(encoding="utf-8").count("\n") + 1)
    for node in ast.walk(ast.parse(Path(path).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            for number, line in enumerate(node.value.split("\n"), start=node.lineno - 1):
                lines[min(number, len(lines) - 1)] += f" {line}"
    return "\n".join(lines)


def main() -> int:
    """Print the unusual words, and return 1 if there are any."""
    source = "--source" in sys.argv
    patterns = [f"{root}/*.py" for root in ("core", "adapters", "drivers", "simulation")] if source else ["*.md"]
    listed = subprocess.run(["git", "ls-files", "--", *patterns], capture_output=True, text=True, check=True).stdout
    read = strings if source else lambda page: Path(page).read_text(encoding="utf-8")
    odd = [(page, *one) for page in listed.splitlines() for one in found(read(page))]
    for page, line, word, standard in odd:
        sys.stderr.write(f"{page}:{line}: {word!r}; the field says: {standard}\n")
    return 1 if odd else 0


if __name__ == "__main__":
    sys.exit(main())
