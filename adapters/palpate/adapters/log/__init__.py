"""A trial's log on disk: an MCAP file with protobuf messages, one per control tick."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
