"""The kernel language: text → typed representation → scalar program.

Read in the order in which a kernel passes through: :mod:`.types`, :mod:`.symbols` (what users write),
:mod:`.source` and :mod:`.scope` (text and names), :mod:`.signature`, :mod:`.expressions`, :mod:`.parse`
(to :mod:`.ir`), :mod:`.operations` and :mod:`.prelude` (what operations mean), :mod:`.lower` (to :mod:`.scalar`).
"""
