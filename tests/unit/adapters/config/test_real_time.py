"""Settings of real-time behaviour are refused in one line that says what would do."""

import pytest

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.core.errors import ConfigurationError


def test_by_default_nothing_is_asked_of_the_system() -> None:
    config = RealTimeConfig()
    assert not config.scheduling
    assert not config.lock_memory
    assert not config.stay_awake
    assert config.cpu == -1
    assert config.stop_late_ms == 0.0


def test_a_warning_that_would_come_after_the_stop_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="warn_late_ms"):
        RealTimeConfig(warn_late_ms=5.0, stop_late_ms=4.0)
    RealTimeConfig(warn_late_ms=5.0, stop_late_ms=5.0)
