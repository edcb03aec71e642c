"""Passes that rewrite a scalar program for a device, before its printer spells the rows.

Each takes a program and returns one.  Instructions are counted, and passes fused, before lowering.
"""

from __future__ import annotations

from passgraph.language.lowering.passes import Pass as Pass
from passgraph.language.lowering.passes import lowered as lowered
