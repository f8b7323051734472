"""The tasks that come with palpate, and what they share. The loop and the supervisor know none of them."""
