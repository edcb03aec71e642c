"""Effects from what an engine has: its picture and its depth buffer."""
