"""The core of palpate: ports, perception, policies, control, and the insertion task.

The core performs no I/O and reads no clock; :mod:`palpate.core.control_loop` runs it over the four ports of
:mod:`palpate.core.ports.devices`. Import modules explicitly (``from palpate.core.tasks.insertion.task import
InsertionTask``), so that a program loads only what it uses. ``__version__`` is the version of the installed
distribution.
"""


def __getattr__(name: str) -> str:
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version("palpate")
