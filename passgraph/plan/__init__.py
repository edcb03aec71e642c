"""From a graph to a plan: validate, specialise, cull, fuse, order, share memory.  No device needed."""
