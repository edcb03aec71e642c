"""The oracle: bounds of what a conforming backend may compute, pixel by pixel, from the reference over intervals.

In reading order: ``interval`` (arithmetic), ``functions`` (the rest of the operations table), ``decisions`` (what
rounding may change, tried both ways), ``vectors`` and ``domain`` (for the reference's interpreter), ``storage``
(formats), ``stage``; ``coverage`` and ``merge`` (draws); ``allowed``, ``backend`` (passes and draws), ``passes`` (a
graph); also ``kept`` (cached bounds), ``time_limit`` and ``watch`` (causes of wide bounds).
"""
