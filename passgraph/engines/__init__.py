"""Effects inside engines: one module an engine, each with ``attach(<what the engine has>, effect, **values)``.

What all of them share is ``attachment``; an adapter is the engine's hook, its camera and what it draws into.
"""
