from .can import Jr3CanNode as Jr3CanNode
