"""A recorded trial as a film or a sheet of pictures."""
