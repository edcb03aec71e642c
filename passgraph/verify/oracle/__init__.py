"""What a conforming backend may compute, pixel by pixel: the reference over intervals.

In reading order: ``interval`` (arithmetic), ``functions`` (the rest of the operations table), ``decisions`` (what
rounding may turn, tried both ways), ``domain`` (for the reference's interpreter), ``stage``, ``backend``.
"""
