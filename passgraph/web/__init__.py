"""Effects in a browser: a plan as data, and the page and modules that run it.

Read in this order: ``export`` (a folder), ``document`` (effect.json), ``recorder`` (pipelines without a device),
``size_rules``, ``orbit`` (poses of a camera); then ``page/passgraph.js`` (the runtime) and ``page/page.js`` (the page).
"""

from __future__ import annotations

from passgraph.web.export import export_web
from passgraph.web.orbit import Orbit

__all__ = ["Orbit", "export_web"]
