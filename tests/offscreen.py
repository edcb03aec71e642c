"""OpenGL contexts of somebody else's, off screen: each current from when it is made, and gone when it ends.

A context that is destroyed while it is current lives on until another one takes its place, which may then be known by
the number that it had.  So it is put aside first, whichever is current by then.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import moderngl


@contextmanager
def offscreen(require: int = 330) -> Iterator[moderngl.Context]:
    """One of a version or a later one, with all that is made in it."""
    context = moderngl.create_context(standalone=True, require=require, backend="egl")
    try:
        yield context
    finally:
        with context:
            pass
        context.release()
