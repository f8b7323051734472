"""The tasks that come with palpate, and what they share. The loop and the supervisor depend on none of them."""
