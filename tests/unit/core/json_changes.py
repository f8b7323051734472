"""A JSON file with one thing changed, and how it is refused."""

import json

import pytest

from palpate.core.errors import ConfigurationError


def require_refused(read, made, field):
    """The text is refused in one line that names the field."""
    with pytest.raises(ConfigurationError) as refused:
        read(json.dumps(made))
    assert refused.value.field == field
    assert len(str(refused.value).splitlines()) == 1
