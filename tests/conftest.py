"""Settings for all tests."""

from hypothesis import settings

# The same examples at every run, and no stopwatch: a busy machine must not fail a property.
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")
