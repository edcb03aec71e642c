"""Rows of the table of operations: each is whole, and the names of the language follow from it."""

from __future__ import annotations

import ast
from dataclasses import fields

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference.interpreter import KINDS
from passgraph.language import functions, primitives, vectors, whole_numbers
from passgraph.language.expand import EXPANSIONS
from passgraph.language.library import prelude_function
from passgraph.language.operation import ROWS, Domain, Operation
from passgraph.language.operations import BUILTINS, FUNCTIONS, OPERATIONS, called, signed
from passgraph.verify.conformance.operation_cases import floats, into
from passgraph.verify.fuzz.random_expressions import CALLS, WHOLE

NAMES = list(OPERATIONS)
MODULES = (primitives, functions, whole_numbers, vectors)
TUPLES = [field.name for field in fields(Operation) if str(field.type).startswith("tuple")]


@pytest.mark.parametrize("name", NAMES)
def test_a_row_is_whole(name: str) -> None:
    row = OPERATIONS[name]
    assert row.doc
    assert row.examples and all(len(example) == len(row.operands) + 1 for example in row.examples)
    assert all(type(getattr(row, field)) is tuple for field in TUPLES)
    assert all(
        isinstance(form, str) and isinstance(ast.parse(form, mode="eval").body, ast.expr) for form in row.written
    )
    assert all(isinstance(domain, Domain) and domain.low < domain.high for domain in row.domain)
    assert all(low < high for low, high in row.tame)
    assert row.ulp >= 0 and row.absolute >= 0
    assert set(row.types) <= set(KINDS)


def test_a_name_has_one_row() -> None:
    assert len(ROWS) == len(OPERATIONS)


@pytest.mark.parametrize("name", [row.name for row in OPERATIONS.values() if row.kind == "prelude"])
def test_a_prelude_row_has_its_function(name: str) -> None:
    row = OPERATIONS[name]
    for function in [name, f"{name}_int"][: 2 if "N" in row.operands else 1]:
        assert len(prelude_function(function).node.args.args) == len(row.operands)


def test_an_expanded_row_has_its_expansion() -> None:
    assert set(EXPANSIONS) == {row.name for row in OPERATIONS.values() if row.kind == "expanded"}


def test_every_function_is_a_name() -> None:
    """To mend: write ``name = _row("name", …)`` where kernels call a row by its name, ``_row("name", …)`` elsewhere."""
    assigned = {name for module in MODULES for name, value in vars(module).items() if isinstance(value, Operation)}
    assert assigned == set(FUNCTIONS)
    assert all(getattr(pg, name) is row and row.call == name for name, row in FUNCTIONS.items())
    assert (BUILTINS[abs], BUILTINS[pow]) == ("abs", "pow")


@pytest.mark.parametrize("module", MODULES)
def test_a_star_import_takes_functions_alone(module: object) -> None:
    public = {name for name in vars(module) if name.isidentifier() and name[0] != "_"} - {"annotations"}
    assert public <= set(FUNCTIONS)


def test_a_function_on_the_host_is_an_error_that_names_it() -> None:
    with pytest.raises(pg.PassgraphError, match=r"dot\(\) exists inside kernels only"):
        pg.dot((1, 2), (3, 4))
    assert repr(pg.dot) == "<passgraph function dot>"


def test_what_is_written_says_which_row() -> None:
    assert [row.name for row in signed("//", 2)] == ["floor_divide", "float_floor_divide", "floor_divide_uint"]
    assert [row.name for row in signed("-", 1)] == ["neg"]
    assert (called("atan", 1), called("atan", 2), called("atan", 3)) == ("atan", "atan2", "atan")


@pytest.mark.parametrize(
    ("name", "by_sign", "by_name"),
    [
        ("less", "(x < y)", "less(x, y)"),
        ("mod", "(x % y)", "mod(x, y)"),
        ("atan2", "atan(x, y)", "atan(x, y)"),
        ("add", "(x + y)", "(x + y)"),
        ("dot", "dot(x, y)", "dot(x, y)"),
    ],
)
def test_a_row_is_written_as_kernels_write_it(name: str, by_sign: str, by_name: str) -> None:
    assert OPERATIONS[name].as_written("x", "y") == by_sign
    assert OPERATIONS[name].as_written("x", "y", by_name=True) == by_name


@pytest.mark.parametrize("name", CALLS)
def test_ordinary_operands_have_ordinary_results(name: str) -> None:
    """To mend: give the row a ``tame`` range on which its results stay within ±8."""
    row = OPERATIONS[name]
    for operand in range(len(row.operands)):
        low, high = row.ordinary(operand)
        domain = row.domain_of(operand)
        assert max(WHOLE[0], domain.low) <= low < high <= min(WHOLE[1], domain.high)
    low, high = CALLS[name][1]
    assert WHOLE[0] <= low < high <= WHOLE[1]


ELSE = [Domain(1.0), Domain(-3.0, 5.0), Domain(-2.0, 2.0, 0.25), Domain(-2.0, 2.0, 0.25, zero=False)]


OF_ROWS = dict.fromkeys(domain for row in OPERATIONS.values() for domain in row.domain)


@pytest.mark.parametrize("domain", [*OF_ROWS, *ELSE], ids=str)
def test_special_values_are_brought_into_a_domain(domain: Domain) -> None:
    made = np.asarray(into(domain, floats()))
    made = made[np.isfinite(made)]
    assert len(np.unique(made)) > 20
    assert (made >= domain.low).all() and (made <= domain.high).all()
    small = np.abs(made) < domain.least
    assert (made[small] == 0).all() and (domain.zero or not small.any())
