"""Effects from what an engine has: its picture and its depth buffer.

Reading order: `engine_depth`, distances from a depth buffer, then the effects, each in its file.
"""
