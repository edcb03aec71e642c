"""The kernel language: text → typed representation → scalar program.

Read in the order in which a kernel passes through:

1. :mod:`.types`, :mod:`.symbols` (what users write), :mod:`.source`, :mod:`.scope` (text and names),
   :mod:`.kernel`.
2. :mod:`.signature`, :mod:`.parse`, :mod:`.frame`, :mod:`.statements`, :mod:`.assignments`,
   :mod:`.expressions`, :mod:`.values`, :mod:`.variables` and :mod:`.typing_rules` (to :mod:`.ir`).
3. :mod:`.operations`, the table (a row is an :mod:`.operation`; they stand in :mod:`.primitives`, :mod:`.functions` and
   :mod:`.vectors`, with :mod:`.meanings` and :mod:`.domains`), :mod:`.prelude` and :mod:`.library`.
4. :mod:`.facts`, :mod:`.lower`, :mod:`.expand`, :mod:`.emitter` and :mod:`.liveness` (to :mod:`.scalar`),
   :mod:`.lowered` (from disk), :mod:`.layout`.
"""
