"""Compile targets: check and plan the graph, and open a backend."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast, get_args

from passgraph import arguments
from passgraph.errors import BackendError
from passgraph.graph.targets import Outputs, checked_size, named_outputs
from passgraph.plan.data import Options
from passgraph.plan.limits import bytes_of
from passgraph.run.finite_checks import NonFinite, checked_choice
from passgraph.run.program import Program
from passgraph.run.result import Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


def compile(
    outputs: Outputs,
    backend: str | Backend | None = None,
    size: tuple[int, int] | None = None,
    options: Options | None = None,
    *,
    non_finite: NonFinite = "error",
    check_finite: bool = False,
    results: Results = "float32",
    memory: int | str | None = None,
) -> Program:
    """Plan the graph behind some targets and prepare it to run.

    Parameters
    ----------
    outputs
        One target, several, or ``{name: target}``; results are read by target name or by the given name.
    backend
        ``"numpy"`` (default), ``"gl"``, ``"opencl"``, ``"opencl:1"``, ``"webgpu"``, ``"reference"``, or an open
        backend, which the caller closes.
    size
        (width, height) of the output in pixels; default: the size of the first input.  Targets declared with a size, or
        with the size of an input, keep it.  An error if no output has this size or a fraction of it.
    options
        Optimizations to switch off.
    non_finite
        Treatment of NaN and infinity in an input: ``"error"`` raises an ``InputError`` that names the pixel and the
        passes that read it; ``"replace"`` makes NaN 0 and infinity the largest number of the input's format; ``"keep"``
        passes them on.  Static inputs are checked once; 8- and 16-bit integers are never checked.
    check_finite
        Check what every pass wrote, and raise a ``GraphError`` that names the first pass and pixel where finite values
        gave one that is not finite.  Slow: every target is read back, and no passes are fused.
    results
        ``"float32"``: values, 0 to 1 for normalized formats; ``"stored"``: the target's own dtype, such as
        uint8 for ``rgba8``.

    memory
        Memory limit for inputs and targets: bytes, or text such as ``"2 GB"``. Default: half of the memory of the
        machine or container. Checked on the plan, before anything is allocated.

    Raises
    ------
    GraphError, KernelError
        For a graph that is inconsistent or exceeds ``memory``; if an input's size is open, at the first run.
    BackendError
        For a pass with more images, parameters or targets, or a larger picture, than the device supports.
    DeviceMissingError
        If the backend's driver is missing, with the command that installs it.

    Examples
    --------
    >>> import numpy as np
    >>> from passgraph.graph.calls import kernel
    >>> from passgraph.graph.targets import Input
    >>> invert = kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> with compile(invert(Input("frame")), backend="reference") as program:
    ...     program(frame=np.zeros((2, 3, 4), np.float32))["invert"].shape
    (2, 3, 4)
    """
    from passgraph.backends.base import Backend
    from passgraph.backends.registry import open_backend

    named = named_outputs(outputs)
    bound = None if size is None else checked_size(size, "the output")
    choice = checked_choice(non_finite)
    checking = arguments.flag(check_finite, "check_finite")
    if options is None:
        options = Options()
    arguments.instance(options, Options, "options", "pg.Options(...)")
    owns = backend is None or isinstance(backend, str)
    expected = "a name such as 'gl' or an open backend"
    opened = open_backend(backend) if owns else arguments.instance(backend, Backend, "backend", expected, BackendError)  # type: ignore[arg-type]
    typed = cast("Results", arguments.one_of(results, "results", get_args(Results)))
    program = Program(named, opened, owns, bound, options, choice, checking, typed)
    program.most_memory = None if memory is None else bytes_of(memory)
    try:
        if all(spec.size and spec.format for spec in program.inputs.values()):
            assert program.plan is not None
    except BaseException:
        program.close()
        raise
    return program
