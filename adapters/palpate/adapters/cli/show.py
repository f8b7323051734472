"""``palpate show``."""

import sys
from pathlib import Path

from palpate.adapters.cli.options import ShowOptions
from palpate.adapters.experiments import render_table
from palpate.adapters.experiments.grid import believed, labels, policy_memory, render_memory
from palpate.adapters.visualisation import memory_picture
from palpate.core.errors import ConfigurationError
from palpate.core.policy import PolicyDocument
from palpate.core.policy.memory import MemoryDocument, is_memory_file
from palpate.core.ports import new_file, require_no_file

_PICTURES = ("svg", "png")


def show(options: ShowOptions) -> int:
    """Print the table of a policy file, or what a memory file holds, or draw that; returns the exit code."""
    path = Path(options.file)
    if is_memory_file(path):
        document = MemoryDocument.load(path)
    else:
        policy = PolicyDocument.load(path)
        if policy.memory is None and (options.after or options.out):
            accepted = "a memory file, or a policy file of the learner memory, with --after or --out"
            raise ConfigurationError("file", options.file, accepted)
        if not options.out:
            sys.stdout.write(render_table(policy))
        if policy.memory is None:
            return 0
        document = policy_memory(policy, policy.memory)
    if options.out:
        _draw(document, options.after, Path(options.out))
    else:
        sys.stdout.write(render_memory(document, options.after))
    return 0


def _draw(document: MemoryDocument, after: str, path: Path) -> None:
    kind = path.suffix.removeprefix(".")
    if kind not in _PICTURES:
        raise ConfigurationError("out", str(path), f"a file name that ends in .{' or .'.join(_PICTURES)}")
    require_no_file(path)
    content = memory_picture(document, believed(document, after), after, kind, labels(document.symbols))
    with new_file(path) as file:
        file.write_bytes(content)
    sys.stdout.write(f"saved as {path}\n")
