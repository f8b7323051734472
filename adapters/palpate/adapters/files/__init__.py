"""Files and folders, read and written whole: of policies, examples, automata, strings and any other content."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
