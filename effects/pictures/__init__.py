"""Effects on pictures."""
