"""Device protocols: codecs, conversations and transports. Drivers and core do not import each other."""
