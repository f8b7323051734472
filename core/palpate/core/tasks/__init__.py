"""palpate's tasks and their shared code. The loop and the supervisor depend on none of these tasks."""
