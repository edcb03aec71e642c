"""Whatever is handed in: what comes back is an error of ours that names it, or an answer, never Python's exception.

The table holds each text; the sweep puts every value of a list into every argument of every public call.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import language
from passgraph.arguments import shown
from passgraph.backends.registry import open_backend
from tests import wrong_sweep
from tests.wrong_sweep import Call
from tests.wrong_uses import USES
from tests.wrong_values import frame, kernel, values

#: Longest text that an error of an argument may have: two values of `arguments.MOST_SHOWN`, and what was expected.
LONGEST = 600


@pytest.mark.parametrize("name", USES)
def test_wrong_uses_are_told(name: str) -> None:
    wrong = USES[name]
    with pytest.raises(wrong.error, match=wrong.words) as caught:
        wrong.use()
    assert isinstance(caught.value, pg.PassgraphError)
    assert len(str(caught.value)) <= LONGEST


@pytest.mark.sampled
@pytest.mark.parametrize("call", wrong_sweep.calls(), ids=lambda call: call.name)
def test_no_argument_leads_to_an_error_that_is_not_ours(call: Call) -> None:
    raised = 0
    for argument in call.good:
        for name, value in values().items():
            if callable(value) and argument in ("observe", "values", "watch"):
                continue  # what it raises is its own
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    call(argument, value)
            except pg.PassgraphError as error:
                raised += 1
                if len(str(error)) > LONGEST:
                    pytest.fail(f"{call.name}({argument}={name}) tells too much: {error}")
            except Exception as error:
                pytest.fail(f"{call.name}({argument}={name}) raises {type(error).__name__}: {error}")
    assert raised  # every call has arguments that do not fit


def test_the_calls_of_the_sweep_are_right_as_they_are() -> None:
    """Else every wrong value would be refused for another reason."""
    wrong = {
        "kernel",
        "vertex",
        "fragment",
        "function",
        "struct",
        "load",
        "load_program",
        "load_shader",
        "save",
        "Result.save",
        "Scene.load",
        "files.Audio",
    }
    for call in wrong_sweep.calls():
        if call.name not in wrong:
            call()


def test_every_public_name_is_swept() -> None:
    """A new entry of ``passgraph`` or of an effects' package has to be added."""
    swept = {call.name.split(",")[0].split(".")[0] for call in wrong_sweep.calls()}
    plain = {
        "FRAME_INDEX", "OUTPUT_SIZE", "Program", "PassgraphError", "BackendError", "DeviceMissingError", "GraphError",
        "InputError", "KernelError",
        "view",  # a server; tests/viewer has what it refuses
    }  # fmt: skip
    of_kernels = set(language.__all__)  # told by kernels' own errors
    assert set(pg.__all__) - plain - of_kernels <= swept


# What is right, beside what is wrong


@pytest.mark.parametrize("name", ["self", "size", "given", "frame", "_observe"])
def test_inputs_may_have_any_name(name: str) -> None:
    with pg.compile(kernel("copy")(frame(name)), "reference") as program:
        picture = np.full((4, 8, 4), 0.25, np.float32)
        assert program(**{name: picture})["copy"].tolist() == picture.tolist()


HALF = np.array([[0.0, 0.5], [0.25, 1.0]])
BYTES = np.array([[0, 255], [51, 102]], np.uint8)
STRIDED = np.zeros((4, 6))
STRIDED[::2, ::3] = HALF
LAYOUTS: dict[str, tuple[Any, Any]] = {
    **{dtype: (HALF.astype(dtype), HALF) for dtype in ("<f4", ">f4", "<f2", ">f2", "<f8", ">f8", "longdouble")},
    **{dtype: ((BYTES * np.uint16(257)).astype(dtype), BYTES / 255) for dtype in ("<u2", ">u2")},
    "u1": (BYTES, BYTES / 255),
    "bool": (HALF == 0.5, HALF == 0.5),
    "transposed": (HALF.T, HALF.T),
    "transposed bytes": (BYTES.T, BYTES.T / 255),
    "fortran": (np.asfortranarray(HALF), HALF),
    "backwards": (HALF[::-1, ::-1], HALF[::-1, ::-1]),
    "no strides": (np.broadcast_to(np.float32(0.5), (2, 2)), np.full((2, 2), 0.5)),
    "every other": (STRIDED[::2, ::3], HALF),
    "lists": (HALF.tolist(), HALF),
    "nothing masked": (np.ma.masked_array(HALF, False), HALF),
    "unaligned": (np.frombuffer(b"\0" + HALF.tobytes(), "<f8", offset=1).reshape(2, 2), HALF),
    "read only": (np.frombuffer(HALF.tobytes()).reshape(2, 2), HALF),
}


def test_pictures_of_every_layout_are_taken(backend_name: str) -> None:
    with pg.compile(kernel("copy")(pg.Input("frame", "r32f", (2, 2))), backend_name) as program:
        for name, (given, expected) in LAYOUTS.items():
            got = program(frame=given)["copy"][:, :, 0]
            assert got.tolist() == np.asarray(expected, np.float32).tolist(), name


INTS = "def k(c: Image{}) -> vec4: return vec4(float({n} >> 16 & 0xFFFF), float({n} & 0xFFFF), float({n}), 1.0)"
#: What is given, and the int with these bits: Python's own arithmetic is the truth.
MEANT: list[tuple[Any, int]] = [
    (2**31 - 1, 2**31 - 1), (-(2**31), -(2**31)), (2**31, -(2**31)), (0xFFFFFFFF, -1),
    (np.uint32(0x80000001), 1 - 2**31),
]  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("way", ["baked", "run", "set", "text", "array"])
def test_bit_patterns_mean_the_int_with_these_bits(way: str, backend_name: str) -> None:
    """The upper and lower half tell the bits, exactly."""
    for given, meant in MEANT:
        source, named = INTS.format(", n: int", n="n"), {"n": pg.Value("n", int) if way == "run" else 0}
        if way == "baked":
            source, named = INTS.format(", n: Const[int]", n="n"), {"n": given}
        if way == "text":
            source, named = f"N = {int(given):#x}\n" + INTS.format("", n="N"), {}
        if way == "array":
            source, named = INTS.format(", n: Array[int, 2]", n="n[1]"), {"n": [0, int(given)]}
        with pg.compile(pg.kernel(source=source)(frame(), **named), backend_name) as program:
            if way == "set":
                program.set("k", "n", given)
            got = program(frame=wrong_sweep.FRAME, **({"n": given} if way == "run" else {}))["k"][0, 0]
        assert got.tolist() == [meant >> 16 & 0xFFFF, meant & 0xFFFF, np.float32(meant), 1.0], given


@pytest.mark.parametrize(
    ("value", "meant"),
    [
        ("0xFFFFFFFF", 4294967295.0),
        ("0x80000000", 2147483648.0),
        ("-2147483648", -2147483648.0),
        ("(0xFFFFFFFF)", 4294967295.0),
    ],
)
def test_bits_where_a_float_is_declared_are_a_number(value: str, meant: float) -> None:
    source = f"def k(c: Image, x: float = {value}) -> float: return x"
    with pg.compile(pg.kernel(source=source)(frame()), "reference") as program:
        assert program(frame=wrong_sweep.FRAME)["k"][0, 0, 0] == np.float32(meant)


@pytest.mark.parametrize("value", [np.float32(3.4028235e38), 3.4028235e38, -3.4028235e38, float("inf"), 2**100, 1e-300])
def test_floats_within_their_range_are_taken(value: Any) -> None:
    with pg.compile(
        pg.kernel(source="def k(c: Image, x: float) -> float: return x")(frame(), value), "numpy"
    ) as program:
        assert program(frame=wrong_sweep.FRAME)["k"][0, 0, 0] == np.float32(value)


def test_a_program_goes_on_after_its_observer_was_refused() -> None:
    with pg.compile(kernel("copy")(frame()), "reference") as program:
        with pytest.raises(pg.GraphError, match="cannot be closed from inside its own run"):
            program.run(lambda *_: program.close(), frame=wrong_sweep.FRAME)
        assert program(frame=wrong_sweep.FRAME)["copy"].tolist() == wrong_sweep.FRAME.tolist()


def test_errors_show_any_value_shortly() -> None:
    for value in values().values():
        assert len(shown(value)) < 100


@pytest.mark.parametrize("name", ["numpy:²", "numpy:-1", "numpy:99999999999", "gl:²", "opencl:²"])
def test_devices_that_are_not_there(name: str) -> None:
    with pytest.raises(pg.BackendError):
        open_backend(name)
