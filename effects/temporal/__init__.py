"""Effects over several frames: motion, and history of earlier pictures."""
