"""Device drivers: codecs, communication and transports. The drivers and the core do not import each other."""
