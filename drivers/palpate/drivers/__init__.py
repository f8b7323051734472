"""Device protocols: codecs, conversations and transports. They know nothing of the core, and it nothing of them.

No device family has landed yet; :mod:`palpate.adapters` is where one will meet the ports.
"""
