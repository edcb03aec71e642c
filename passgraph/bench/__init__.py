"""Shadow methods side by side: what each costs, and how far each is from what rays say.

`scenes` names what is drawn and `methods` how; `truth` traces what should come out; `timing` runs frames in turn,
`metrics` compares, `measure` does all of it, and `pareto`, `charts`, `tables` and `report` show it.
"""
