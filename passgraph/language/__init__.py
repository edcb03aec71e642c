"""The kernel language: text → typed representation → scalar program.

Read the modules in the order in which they process a kernel:
1. :mod:`.types`, :mod:`.symbols` (names for users), :mod:`.source`, :mod:`.scope` (names, and hints for names of other
   languages), :mod:`.kernel`.
2. :mod:`.signature` with :mod:`.parameter_limits` and :mod:`.long_arrays`; :mod:`.parse`, :mod:`.function_body`,
   :mod:`.statements`, :mod:`.assignments`, :mod:`.expressions`, :mod:`.image_reads`, :mod:`.values`,
   :mod:`.composites` and :mod:`.typing_rules` (to :mod:`.ir`); :mod:`.looping` for other front ends; behind them
   :mod:`.quad_derivatives`.
3. :mod:`.operations`, the table: a row is an :mod:`.operation`; rows are in :mod:`.primitives`, :mod:`.functions`,
   :mod:`.vectors` and :mod:`.whole_numbers`, with :mod:`.meanings`, :mod:`.prelude`, :mod:`.prelude_whole` and
   :mod:`.library`; border rules: :mod:`.border_rules`, :mod:`.borders`.
4. :mod:`.facts`, :mod:`.sized`, :mod:`.lower` with :mod:`.lower_loops`, :mod:`.lower_arrays` and :mod:`.value_ranges`,
   :mod:`.expand`, :mod:`.evaluate` and :mod:`.emitter` (to :mod:`.scalar`), :mod:`.lower_cache` (from disk),
   :mod:`.uniform_layout`.
"""
