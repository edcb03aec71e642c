"""A live view in the browser: parameters, targets, time, pixels and two backends side by side.

Read in this order: :mod:`.subject` (the effect or graph to view), :mod:`.display` (targets to displayable pictures),
:mod:`.compiled` (the programs), :mod:`.session` (the computing thread), :mod:`.debugger` (lines, passes, code),
:mod:`.recording` (videos), :mod:`.messages` (messages and files of pages), :mod:`.server` (the page in the browser and
access to it), :mod:`.widget` (the page in a cell of a notebook).
"""
