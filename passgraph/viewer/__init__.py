"""A live view in the browser: parameters, targets, time, pixels and two backends side by side.

Read in this order: :mod:`.subject` (what is viewed), :mod:`.display` (a target as a picture to look at),
:mod:`.compiled` (the programs), :mod:`.session` (the thread that computes), :mod:`.debugger` (questions),
:mod:`.recording` (videos), :mod:`.server` (the page, and who may see it).
"""
