"""Effects on an engine's picture and depth buffer."""
