"""The tool of the paper's cell, for tests that need no more than its lengths."""

from palpate.core.job import ToolConfig

TOOL = ToolConfig().geometry
