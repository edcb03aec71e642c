"""A plan bound to inputs and a device."""
