"""A belief over the hole's position, with a contact model learned from episode outcomes, and a planner."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
