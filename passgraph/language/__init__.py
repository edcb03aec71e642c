"""The kernel language: text → typed representation → scalar program.

Read in the order in which a kernel passes through:

1. :mod:`.types`, :mod:`.symbols` (what users write), :mod:`.source`, :mod:`.scope` (text and names; names of other
   languages: :mod:`.foreign`), :mod:`.kernel`.
2. :mod:`.signature` with :mod:`.limits` and :mod:`.buffers` (long arrays), :mod:`.parse`, :mod:`.frame`,
   :mod:`.statements`, :mod:`.assignments`, :mod:`.matching`, :mod:`.expressions`, :mod:`.powers`, :mod:`.images`,
   :mod:`.values`, :mod:`.composites`, :mod:`.variables` and :mod:`.typing_rules` (to :mod:`.ir`); of other front-ends
   :mod:`.looping`.  Behind them :mod:`.feeding` and :mod:`.quads` (derivatives).
3. :mod:`.operations`, the table (a row is an :mod:`.operation`; they stand in :mod:`.primitives`, :mod:`.functions`,
   :mod:`.vectors` and :mod:`.whole_numbers`, with :mod:`.meanings` and :mod:`.domains`), :mod:`.prelude`,
   :mod:`.prelude_whole` and :mod:`.library`; rules of borders: :mod:`.border_rules`, :mod:`.borders`.
4. :mod:`.facts`, :mod:`.sized`, :mod:`.lower` with :mod:`.lower_loops`, :mod:`.ranges`, :mod:`.lower_elements`,
   :mod:`.lower_buffers` and :mod:`.arrays`, :mod:`.evaluate`, :mod:`.expand`, :mod:`.emitter` and :mod:`.liveness` (to
   :mod:`.scalar`), :mod:`.lower_cache` (from disk), :mod:`.nameless`, :mod:`.layout`, :mod:`.repeated` (of long
   programs).
"""
