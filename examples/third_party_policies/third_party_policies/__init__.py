"""Third-party policies for palpate."""
