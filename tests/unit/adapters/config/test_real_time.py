"""Settings of real-time behaviour are refused in one line that says what would do."""

import pytest

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.core.errors import ConfigurationError


def test_a_warning_that_would_come_after_the_stop_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="warn_late_ms"):
        RealTimeConfig(warn_late_ms=5.0, stop_late_ms=4.0)
    RealTimeConfig(warn_late_ms=5.0, stop_late_ms=5.0)
