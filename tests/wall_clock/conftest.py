"""Settings for the tests that need the wall clock."""

from collections.abc import Iterator

import pytest

from tests.wall_clock.host import Host


@pytest.fixture(scope="session")
def host() -> Iterator[Host]:
    """What the host gives while these tests run."""
    watched = Host()
    try:
        yield watched
    finally:
        watched.close()
