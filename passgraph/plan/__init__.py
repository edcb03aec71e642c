"""The planner: validate, specialize, cull, fuse, order, share memory. Needs no device."""
