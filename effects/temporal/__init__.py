"""Effects over several frames: what moved where, and what earlier pictures say about this one."""
