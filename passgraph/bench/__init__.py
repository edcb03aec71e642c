"""Time against error, side by side.

Of shadow methods, against what rays say: `scenes` names what is drawn and `methods` how; `truth` traces what should
come out, `metrics` compares, and `measure` does all of it.  Of a user's own graph, against an exact version of it:
`versions`.  Both run frames in turn (`timing`), look at pictures as people do (`likeness`), and show what nothing
beats (`pareto`, `charts`); `tables` and `report` write the folder of shadow methods.
"""
