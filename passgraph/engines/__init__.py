"""Effects inside engines: a module for each engine, with ``attach(<the engine's window>, effect, **values)``.

``attachment`` is their common part; an adapter adds the engine's hook, its camera and its framebuffer.
"""
