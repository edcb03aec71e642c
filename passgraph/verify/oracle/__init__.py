"""The oracle: what a conforming backend may compute, pixel by pixel; the reference over intervals.

In reading order: ``interval`` (arithmetic), ``functions`` (the rest of the operations table), ``decisions`` (what
rounding may turn, tried both ways), ``vectors`` and ``domain`` (for the reference's interpreter), ``storage`` (what
formats do), ``stage``; ``coverage`` and ``merge`` (of draws); ``allowed``, ``backend`` (passes and draws), ``passes``
(a graph); beside them ``kept`` (bounds that were found before), ``time_limit`` (how long it may take) and ``watch``
(why bounds are as they are).
"""
