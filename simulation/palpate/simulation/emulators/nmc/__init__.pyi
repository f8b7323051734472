from .bus import NmcChain as NmcChain
