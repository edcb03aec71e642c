"""The planner: validate, specialize, cull, fuse, order, alias memory. Needs no device."""
