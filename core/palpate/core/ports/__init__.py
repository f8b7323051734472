"""The four ports, the values that cross them, the life cycle of a device, and the rig that bundles them."""
