"""Report page about a run or a study, with images, tables and their sources; see :func:`.build.page_of`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
