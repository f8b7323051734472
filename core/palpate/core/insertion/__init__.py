"""The insertion task: its phases, the agent that explores, its frame and settings, and what it expects of a tick."""
