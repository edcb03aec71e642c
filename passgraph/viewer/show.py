"""``pg.view``: the live view of the ``view`` command, from a script or a notebook."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph import arguments
from passgraph.effects.checked import Mark
from passgraph.effects.parameters import arguments_from, parameters_of
from passgraph.errors import InputError
from passgraph.graph.calls import PixelKernel
from passgraph.graph.run_values import sources_of
from passgraph.graph.targets import Input, Target, named_outputs
from passgraph.language import ir
from passgraph.pictures import load
from passgraph.plan.dependencies import passes_behind
from passgraph.run.caller_arrays import format_of
from passgraph.run.program import Program
from passgraph.signatures import signature
from passgraph.viewer.subject import Control, Drawing, Loaded

if TYPE_CHECKING:
    from passgraph.viewer.server import View
    from passgraph.viewer.widget import CellView

#: Size of the output if no picture has one.
SIZE = (1280, 720)


class GivenSubject:
    """The caller's effect, kernel, targets or program, on inputs by name."""

    files: Sequence[Path] = ()

    def __init__(self, shown: object, inputs: Mapping[str, Any], size: tuple[int, int] | None) -> None:
        self.shown, self.inputs, self.size = shown, dict(inputs), size
        mark = getattr(shown, "effect", None)
        self.mark = mark if isinstance(mark, Mark) else None
        self.name = self.mark.name if self.mark else getattr(shown, "name", None) or type(shown).__name__.lower()
        if self.mark is None and not isinstance(shown, (PixelKernel, Program, Target, Mapping)):
            raise InputError(
                f"pg.view shows an effect (a function with @effect), a kernel, targets or a program; got "
                f"{arguments.shown(shown)}"
            )

        self._check_names()

    def _check_names(self) -> None:
        """Raise InputError for an input that is no parameter of the effect or kernel."""
        if self.mark is not None:
            known = list(signature(self.shown).parameters)  # type: ignore[arg-type]
        elif isinstance(self.shown, PixelKernel):
            known = [parameter.name for parameter in self.shown.parameters]
        else:
            return
        for name in self.inputs:
            if name not in known:
                raise InputError(f"pg.view: {self.name} has no parameter {name!r}; it takes {', '.join(known)}")

    def load(self) -> Loaded:
        if self.mark is not None:
            controls = [Control.of(parameter) for parameter in parameters_of(self.shown)]  # type: ignore[arg-type]
            return Loaded(tuple(c for c in controls if c is not None and c.name not in self.inputs), self._effect)
        if isinstance(self.shown, PixelKernel):
            numbers = [
                p for p in self.shown.parameters if p.name not in self.inputs and str(p.type) in ("float", "int")
            ]
            return Loaded(tuple(_kernel_control(parameter) for parameter in numbers), self._kernel)
        return Loaded(tuple(self._values()), self._targets)

    def _values(self) -> list[Control]:
        """Return the controls of a graph's scalar run values."""
        controls: dict[str, Control] = {}
        for node in passes_behind(list(self._outputs().values())):
            for source in sources_of(node.values):
                if isinstance(source.default, (int, float)) and source.name not in self.inputs:
                    controls[source.name] = Control(source.name, "float", float(source.default))
        return list(controls.values())

    def _outputs(self) -> dict[str, Target]:
        if isinstance(self.shown, Program):
            return self.shown.outputs
        return named_outputs(self.shown)

    def _effect(self, values: Mapping[str, Any]) -> Drawing:
        assert self.mark is not None
        function: Any = self.shown
        named = {name: self._input(name, value) for name, value in self.inputs.items()}
        outputs = function(**named, **arguments_from(function, dict(values)))
        return self._drawing(named_outputs(outputs))

    def _kernel(self, values: Mapping[str, Any]) -> Drawing:
        kernel: Any = self.shown
        return self._drawing(named_outputs(kernel(**{n: self._input(n, v) for n, v in self.inputs.items()}, **values)))

    def _targets(self, values: Mapping[str, Any]) -> Drawing:
        numbers = {n: v for n, v in values.items() if isinstance(v, (int, float))}
        drawing = self._drawing(self._outputs())
        return Drawing(drawing.outputs, drawing.size, {**drawing.run_inputs, **numbers})

    def _drawing(self, outputs: dict[str, Target]) -> Drawing:
        pictures = {n: v for n, v in self.inputs.items() if isinstance(v, np.ndarray) and v.ndim in (2, 3)}
        size = self.size
        if size is None and isinstance(self.shown, Program):
            size = self.shown._size
        if size is None and pictures:
            height, width = next(iter(pictures.values())).shape[:2]
            size = (width, height)
        return Drawing(outputs, size or SIZE, dict(self.inputs))

    @staticmethod
    def _input(name: str, value: Any) -> Any:
        """Return a graph input for a picture; other values are returned as they are."""
        if not (isinstance(value, np.ndarray) and value.ndim == 3):
            return value
        height, width, channels = value.shape
        return Input(name, format_of(value.dtype, channels), (width, height))

    def replace_input(self, path: Path) -> None:
        pictures = [n for n, v in self.inputs.items() if isinstance(v, np.ndarray) and v.ndim == 3]
        if not pictures:
            raise InputError("there is no picture to be replaced")
        self.inputs[pictures[0]] = load(path)

    def frame_count(self) -> int | None:
        return None

    def frame(self, number: int) -> Mapping[str, Any]:
        return {}

    def audio(self, number: int, values: Mapping[str, Any]) -> None:
        return None

    def command(self, values: Mapping[str, Any]) -> str:
        return ""


def _kernel_control(parameter: ir.Parameter) -> Control:
    low, high = (None, None) if parameter.range is None else (parameter.range.low, parameter.range.high)
    default = parameter.default if parameter.has_default else 1
    return Control(parameter.name, str(parameter.type), default, low, high)


def view(
    shown: object,
    /,
    *,
    backend: str | None = None,
    size: tuple[int, int] | None = None,
    port: int = 0,
    browser: bool = True,
    **inputs: Any,
) -> View | CellView:
    """Show an effect, a kernel, targets or a program live in the browser, with its parameters as sliders.

    In a script the call returns when the page's server is interrupted (Ctrl-C). In a notebook it returns at once, and
    the cell shows the page. Needs ``pip install 'passgraph[view]'``, in a notebook ``'passgraph[notebook]'``.

    Parameters
    ----------
    shown
        An effect such as `passgraph.effects.bloom`, a pixel kernel, one or more targets, or a compiled program, whose
        graph is compiled again.
    backend
        The backend's name; by default that of `passgraph.compile`.
    size
        (width, height) of the output; by default that of the first picture, else 1280x720.
    port
        Port of the page; 0 takes a free one. In a notebook, a port other than 0 shows the page of a local server in a
        frame; by default the page is a widget and needs no port.
    browser
        True to open the page in the browser; ignored in a notebook.
    inputs
        Pictures (height, width, channels) and other arguments by name; ``scene=`` for effects of scenes.

    Returns
    -------
    View or CellView
        The view, with ``close()``; that of a server has ``url``.

    Raises
    ------
    InputError
        For an object that cannot be shown, an input that is no parameter of the effect, and if a package that it
        needs is missing.

    Examples
    --------
    >>> import passgraph as pg
    >>> from passgraph.effects import vignette
    >>> pg.view(vignette, color=pg.load("photo.jpg"))  # doctest: +SKIP
    """
    subject = GivenSubject(shown, inputs, size)
    is_cell = in_notebook()
    if is_cell and not port:
        # Without anywidget, and outside the kernel's event loop, the cell shows the page of a local server.
        with suppress(ImportError, RuntimeError):
            from passgraph.viewer.widget import CellView

            return CellView(subject, backend or "")
    try:
        from passgraph.viewer.server import View
    except ImportError as error:
        extra = "notebook" if is_cell else "view"
        raise InputError(f"pg.view needs {error.name}: pip install 'passgraph[{extra}]'") from None
    page = View(subject, backend or "", port)
    if is_cell:
        page.start()
        return page
    print(f"{subject.name}: {page.url}  (Ctrl-C ends)")
    if browser:
        import webbrowser

        webbrowser.open(page.url)
    page.serve()
    return page


def in_notebook() -> bool:
    """Return True in a cell of Jupyter or marimo."""
    marimo = sys.modules.get("marimo")
    return "ipykernel" in sys.modules or (marimo is not None and bool(marimo.running_in_notebook()))
