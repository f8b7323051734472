"""A trial's log on disk: an MCAP file with protobuf messages, one message per control tick."""
