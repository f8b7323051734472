"""Policies for palpate that are not palpate's own."""
