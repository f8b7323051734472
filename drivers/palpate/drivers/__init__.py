"""Device protocols: codecs, conversations and transports. They import nothing of the core, and it nothing of them."""
