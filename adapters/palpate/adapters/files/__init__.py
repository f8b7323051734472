"""Reading and writing of whole files and folders: policies, examples, automata, strings and other content."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
