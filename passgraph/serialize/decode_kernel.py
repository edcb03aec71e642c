"""Kernels from plain data: typed, bounded, and checked as if the parser had made them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from passgraph.graph.targets import MOST_SLOTS
from passgraph.language import ir
from passgraph.language.parameter_limits import check_type
from passgraph.language.signature import MAX_BUFFER_LENGTH, MAX_STRUCT_DEPTH, MAX_STRUCT_FIELDS, checked_array
from passgraph.language.source import NOWHERE, Span
from passgraph.language.types import (
    BOOL,
    NAMED,
    VEC4,
    Array,
    Scalar,
    Struct,
    Type,
    Vector,
    element_of,
    plain_parts,
)
from passgraph.ranges import Range
from passgraph.serialize.document import Document
from passgraph.serialize.kernel_check import Signature, Unfit, Variables, as_unfit, check_arrays, held
from passgraph.serialize.kernel_rows import CLASSES, ROWS, excess, grown

#: Largest line or column of a kernel's text.
_FARTHEST = 1 << 31


def kernel_from_data(data: object, where: str, document: Document) -> ir.TypedKernel:
    """The kernel that :func:`~.encode.kernel_data` wrote.

    Raises
    ------
    InputError
        For what no kernel of text could be, with the place in the document.
    """
    return _Reader(where, document).kernel(data)


class _Reader:
    def __init__(self, where: str, document: Document) -> None:
        self.where, self.document = where, document
        self.spans: list[Span] = []
        self.rows: list[Any] = []
        self.sizes: dict[int, tuple[int, int]] = {}
        self.signature: Signature

    def kernel(self, data: object) -> ir.TypedKernel:
        document, where = self.document, self.where
        names = ("name", "stage", "parameters", "results", "keep", "body", "source", "rows", "spans", "lines")
        record = document.record(data, where, *names)
        stage = record["stage"]
        if stage not in ("pixel", "vertex", "fragment"):
            document.wrong(f"{where}.stage", "pixel, vertex or fragment", stage)
        self._read_spans(record)
        parameters = self._parameters(record["parameters"])
        try:
            self.signature = Signature(stage, parameters)
        except Unfit as unfit:
            document.wrong(f"{where}.parameters", str(unfit), record["parameters"])
        for number, row in enumerate(document.items(record["rows"], f"{where}.rows")):
            self._read_row(row, f"{where}.rows[{number}]")
        body = self._referred(record["body"], f"{where}.body")
        results = self._results(record["results"])
        self._check_position(stage, results)
        keep = None if record["keep"] is None else self._expression(record["keep"], f"{where}.keep")
        if keep is not None and (stage != "fragment" or keep.type != BOOL):
            document.wrong(f"{where}.keep", "null, or a bool of a fragment kernel", record["keep"])
        self._check_body(body, [one.value for one in results] + ([] if keep is None else [keep]), record, parameters)
        name, source = document.identifier(record["name"], f"{where}.name"), self._span(record["source"], where)
        return ir.TypedKernel(name, stage, parameters, body, results, keep, source)

    def _check_body(
        self, body: tuple[Any, ...], read: list[Any], record: Any, parameters: tuple[ir.Parameter, ...]
    ) -> None:
        try:
            if problem := excess(grown(self.sizes[id(part)] for part in (*body, *read))):
                raise Unfit(f"smaller: {problem}")
            variables = Variables()
            known, _ = variables.block(body, set(), False)
            for one in read:
                variables.read(one, known)
            check_arrays(parameters, *body, *read)
        except Unfit as unfit:
            self.document.wrong(f"{self.where}.body", str(unfit), record["body"])

    def _check_position(self, stage: str, results: tuple[ir.Result, ...]) -> None:
        names = [one.name for one in results]
        place = dict(zip(names, results, strict=True)).get("position")
        if len(set(names)) < len(names) or (stage == "vertex" and (place is None or place.type != VEC4)):
            got = ", ".join(names)
            self.document.wrong(
                f"{self.where}.results", "results of different names, of vertex kernels a vec4 position", got
            )

    # Places in text

    def _read_spans(self, record: Any) -> None:
        document, where = self.document, self.where
        lines = []
        for i, given in enumerate(document.items(record["lines"], f"{where}.lines")):
            place = f"{where}.lines[{i}]"
            file, line, text = document.items(given, place, exactly=3)
            lines.append(
                (document.text(file, place), document.whole(line, place, 0, _FARTHEST), document.text(text, place))
            )
        for i, given in enumerate(document.items(record["spans"], f"{where}.spans")):
            place = f"{where}.spans[{i}]"
            number, column, end = document.items(given, place, exactly=3)
            file, line, text = document.index(number, place, lines, "lines")
            start = document.whole(column, place, 0, _FARTHEST)
            self.spans.append(Span(file, line, start, document.whole(end, place, 0, _FARTHEST), text))

    def _span(self, given: object, where: str) -> Span:
        if given is None:
            return NOWHERE
        found: Span = self.document.index(given, where, self.spans, "spans")
        return found

    # Signature

    def _parameters(self, given: object) -> tuple[ir.Parameter, ...]:
        document, made = self.document, dict[str, ir.Parameter]()
        for i, one in enumerate(document.items(given, f"{self.where}.parameters")):
            place = f"{self.where}.parameters[{i}]"
            ranged = isinstance(one, (list, tuple)) and len(one) > 4
            name, type_data, const, span, *more = document.items(one, place, exactly=5 if ranged else 4)
            name, type_ = document.identifier(name, place), self._type(type_data, place)
            const = document.flag(const, place)
            if name in made:
                document.wrong(place, "a name that no parameter has yet", name)
            if const and not isinstance(type_, (Scalar, Vector)):
                document.wrong(place, "a scalar or vector where it is baked", type_data)
            limits = self._range(more[0], type_, name, f"{place}[4]") if more else None
            made[name] = ir.Parameter(name, type_, const, span=self._span(span, place), range=limits)
        return tuple(made.values())

    def _range(self, given: object, type_: Type, name: str, where: str) -> Range:
        """What a parameter may be: low, high, unit, above, odd."""
        parts = self.document.items(given, where, exactly=len(fields(Range)))
        with self.document.at(where):
            made = Range(*parts)
            check_type(made, type_, name, NOWHERE)
        return made

    def _results(self, given: object) -> tuple[ir.Result, ...]:
        document, made = self.document, list[ir.Result]()
        if not (several := document.items(given, f"{self.where}.results", MOST_SLOTS)):
            document.wrong(f"{self.where}.results", "at least one result", given)
        for i, one in enumerate(several):
            place = f"{self.where}.results[{i}]"
            name, type_data, number = document.items(one, place, exactly=3)
            name, type_ = document.text(name, place), self._type(type_data, place)
            if name and not name.isidentifier() and not (name.isascii() and name.isdigit()):
                document.wrong(place, "a result's name: empty, a number or a name as Python has them", name)
            value = document.index(number, place, self.rows, "rows")
            fits = isinstance(type_, (Scalar, Vector)) and element_of(type_).name == "float"
            if isinstance(value, ir.STATEMENTS) or not fits or value.type != type_:
                document.wrong(place, "a float or a float vector, and an expression of that type", type_data)
            made.append(ir.Result(name, type_, value))  # type: ignore[arg-type]
        return tuple(made)

    def _type(self, given: object, where: str, depth: int = 0) -> Type:
        document = self.document
        document.count(1, where)
        if isinstance(given, str) and given in NAMED:
            return NAMED[given]
        if isinstance(given, (list, tuple)):
            element, length = document.items(given, where, exactly=2)
            if depth >= MAX_STRUCT_DEPTH:
                document.wrong(where, f"arrays and structs at most {MAX_STRUCT_DEPTH} deep", given)
            inner = self._type(element, where, depth + 1)
            made = Array(inner, document.whole(length, where, 1, MAX_BUFFER_LENGTH))  # type: ignore[arg-type]
            try:
                as_unfit(checked_array, made, NOWHERE)
            except Unfit as unfit:
                document.wrong(where, str(unfit), given)
            return made
        if not isinstance(given, dict):
            document.wrong(where, f"a type: {', '.join(NAMED)}, [element, length] or a struct", given)
        if depth >= MAX_STRUCT_DEPTH:
            document.wrong(where, f"structs at most {MAX_STRUCT_DEPTH} deep", given)
        record = document.record(given, where, "struct", "fields")
        fields: dict[str, Type] = {}
        for i, one in enumerate(document.items(record["fields"], where, MAX_STRUCT_FIELDS)):
            name, inner_data = document.items(one, f"{where}.fields[{i}]", exactly=2)
            name = document.identifier(name, f"{where}.fields[{i}]")
            fields[name] = self._type(inner_data, f"{where}.fields[{i}]", depth + 1)
            if len(fields) <= i:
                document.wrong(f"{where}.fields[{i}]", "a name that no field has yet", name)
        struct = Struct(document.identifier(record["struct"], where), tuple(fields.items()))
        if len(plain_parts(struct)) > MAX_STRUCT_FIELDS:
            document.wrong(where, f"structs of at most {MAX_STRUCT_FIELDS} fields, nested ones too", given)
        return struct

    # Rows

    def _read_row(self, given: object, where: str) -> None:
        document = self.document
        row = document.items(given, where)
        cls = CLASSES.get(row[0]) if row and isinstance(row[0], str) else None
        if cls is None:
            document.wrong(where, f"a row that begins with one of {', '.join(CLASSES)}", row[0] if row else row)
        shape = ROWS[cls]
        document.items(row, where, exactly=len(shape) + 2)
        made = [self._field(part, kind, f"{where}.{name}") for part, (name, kind) in zip(row[1:], shape.items())]  # noqa: B905
        try:
            if cls in (ir.Literal, ir.Table):
                made[1] = self._held(*made)
            node = cls(*made, self._span(row[-1], where))
            if not isinstance(node, ir.STATEMENTS):
                self.signature.check(node)
            size = grown(self.sizes[id(part)] for part in ir.parts_of(node))
            if problem := excess(size):
                raise Unfit(f"smaller: {problem}")
        except Unfit as unfit:
            document.wrong(where, f"{unfit} ({row[0]})", given)
        self.sizes[id(node)] = size
        self.rows.append(node)

    def _held(self, type_: Type, value: Any) -> Any:
        if isinstance(value, tuple):
            element = element_of(type_) if isinstance(type_, Array) else None
            if element is None:
                raise Unfit("an array")
            return tuple(held(number, element) for number in value)
        if not isinstance(type_, Scalar):
            raise Unfit("a scalar")
        return held(value, type_)

    def _field(self, given: object, kind: str, where: str) -> Any:
        document = self.document
        if kind == "row":
            return self._expression(given, where)
        if kind == "rows":
            return self._referred(given, where)
        if kind == "type":
            return self._type(given, where)
        if kind == "text":
            return document.text(given, where)
        if kind == "flag":
            return document.flag(given, where)
        if kind == "number":
            return document.number(given, where)
        if kind == "numbers":
            return tuple(document.number(part, where) for part in document.items(given, where))
        return tuple(document.whole(part, where, 0, 3) for part in document.items(given, where, 4))

    def _expression(self, given: object, where: str) -> Any:
        found = self.document.index(given, where, self.rows, "rows")
        if isinstance(found, ir.STATEMENTS):
            self.document.wrong(where, "the number of an expression", given)
        return found

    def _referred(self, given: object, where: str) -> tuple[Any, ...]:
        parts = self.document.items(given, where)
        return tuple(self.document.index(part, where, self.rows, "rows") for part in parts)
