"""A JSON file with one thing changed, and how it is refused."""

import json

import pytest

from palpate.core.errors import ConfigurationError


def put(*keys_and_value):
    """The last one is put where the others lead to."""
    *keys, last, value = keys_and_value

    def change(made):
        for key in keys:
            made = made[key]
        made[last] = value

    return change


def require_refused(read, made, field):
    """The text is refused in one line that names the field."""
    with pytest.raises(ConfigurationError) as refused:
        read(json.dumps(made))
    assert refused.value.field == field
    assert len(str(refused.value).splitlines()) == 1
