"""What pickles and copies hold, and what is refused with the way that there is."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.backends.registry import open_backend
from passgraph.errors import PassgraphError
from passgraph.graph.draw_state import frozen

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pg.function
def halved(color: vec4) -> vec4:
    return color * 0.5


@pg.kernel
def half(color: Image) -> vec4:
    return halved(color[0, 0])


def again(given: object) -> Any:
    return pickle.loads(pickle.dumps(given))


def of_text() -> Any:
    return pg.kernel(source="def half(color: Image) -> vec4: return color[0, 0] * 0.5")


def program() -> Any:
    return pg.compile(half(pg.Input("frame")), backend="reference")


@pytest.mark.parametrize("given", [half, halved], ids=["kernel", "function"])
def test_what_a_module_defines_is_pickled_by_its_name(given: object) -> None:
    assert again(given) is given
    assert copy.deepcopy(given) is given


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_copied_handle_stands_for_the_same_content(copied: Callable[[Any], Any]) -> None:
    frame = pg.Input("frame")
    both = pg.kernel(source="def both(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
    made = copied(SimpleNamespace(kernel=copied(both), frame=frame))
    with pg.compile(made.kernel(made.frame, frame)) as program:
        assert program(frame=np.ones((2, 2, 4), np.float32))["both"].max() == 2.0


@pytest.mark.parametrize("moved", [again, copy.deepcopy])
@pytest.mark.parametrize("kept", [False, True], ids=["mesh", "copy of a mesh"])
def test_a_mesh_stays_one_that_nobody_can_write_to(kept: bool, moved: Callable[[Any], Any]) -> None:
    mesh: Any = pg.Mesh.make(TRIANGLE, [[0, 1, 2]])
    if kept:
        mesh = frozen(SimpleNamespace(positions=np.array(TRIANGLE), triangles=np.array([[0, 1, 2]])))
    there = moved(mesh)
    np.testing.assert_array_equal(there.positions, mesh.positions)
    assert frozen(there) is there  # else it would be copied at each draw
    with pytest.raises(ValueError, match="read-only"):
        there.positions[0] = 1.0


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (of_text, r"kernel half was made from text, .*: define it at the top of a module, or .* pg\.to_data\("),
        (
            lambda: half(pg.Input("frame")),
            r"handle of 'half': graphs cannot be pickled; send plain data: pg\.to_data\(",
        ),
        (program, r"a program has a device of this process, .* from program\.to_data\(\)"),
        (lambda: open_backend("reference"), "reference: an open backend is bound to this process .* give its name"),
    ],
    ids=["kernel of text", "graph", "program", "backend"],
)
def test_what_no_pickle_can_hold_says_what_to_send(make: Callable[[], Any], says: str) -> None:
    with pytest.raises(PassgraphError, match=says):
        pickle.dumps(make())


def test_a_kernel_of_a_function_says_where_to_define_it() -> None:
    @pg.kernel
    def inner(color: Image) -> vec4:
        return color[0, 0]

    with pytest.raises(PassgraphError, match=r"kernel inner was made inside of a function, .* at the top of a module"):
        pickle.dumps(inner)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_program_is_not_copied(copied: Callable[[Any], Any]) -> None:
    with program() as made, pytest.raises(PassgraphError, match="neither copied nor pickled"):
        copied(made)


def test_a_closed_program_is_not_entered() -> None:
    made = program()
    made.close()
    with pytest.raises(PassgraphError, match="this program is closed"):
        made.__enter__()


@pytest.mark.parametrize("what", ["input", "value"])
def test_what_a_run_brings_is_not_called_into(what: str) -> None:
    dimmed = pg.kernel(source="def dimmed(c: Image, by: float) -> vec4: return c[0, 0] * by")
    given = {"input": (pg.Input("into"), 0.5), "value": (pg.Input("frame"), pg.Value("into"))}[what]
    with pytest.raises(PassgraphError, match=f"an? {what} cannot be called 'into', which names the destination arrays"):
        pg.compile(dimmed(*given))
