"""``palpate emulate`` in a separate process, for measurements over emulated connections."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from palpate.adapters.config.rig import RigFile

PALPATE = (sys.executable, "-m", "palpate.adapters.cli.main")


class EmulatedRig:
    """Context manager whose devices are served from its construction until it is closed.

    Args:
        folder: Folder for the rig file and the output.
        words: Arguments of the command.

    Attributes:
        path: Path of the rig file.
    """

    def __init__(self, folder: Path, *words: str, palpate: Sequence[str] = PALPATE) -> None:
        self.path, self._output = folder / "rig.toml", folder / "emulate.txt"
        with self._output.open("w") as output:
            self._process = subprocess.Popen([*palpate, "emulate", "--rig-file", str(self.path), *words], stdout=output)
        while not self.path.exists() or "[force_sensor]" not in self.path.read_text():
            if self._process.poll() is not None:
                raise SystemExit("the emulated devices ended before they were served")
            time.sleep(0.05)

    @property
    def process_id(self) -> int:
        return self._process.pid

    @property
    def inserted(self) -> int:
        """Number of insertions according to the ground truth."""
        return self._output.read_text().count("# inserted")

    def close(self) -> None:
        self._process.terminate()
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def words_of(arm: str, force: str, priority: int) -> tuple[str, ...]:
    return "--wires", arm, "--force", force, "--priority", str(priority)


@contextmanager
def emulated_rig(arm: str, force: str, priority: int) -> Iterator[RigFile]:
    """Serve emulated devices in a temporary folder."""
    # Here, so that ticks of another checkout, which may lack it, can be measured over these devices too.
    from palpate.adapters.config.rig import RigFile

    with tempfile.TemporaryDirectory() as folder, EmulatedRig(Path(folder), *words_of(arm, force, priority)) as rig:
        yield RigFile.load(rig.path)
