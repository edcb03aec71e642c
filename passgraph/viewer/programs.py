"""The programs that show a subject: compiled again when more than run values changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.errors import InputError
from passgraph.graph.run_values import Value
from passgraph.graph.targets import Input, Target
from passgraph.run.caller_arrays import format_of
from passgraph.viewer.compiled import Compiled
from passgraph.viewer.requests import Settings
from passgraph.viewer.subject import Drawing, Loaded, Subject, run_values_of

#: The name of a picture file among the backends to compare with, and the name of its input.
REFERENCE_FILE, REFERENCE_INPUT = "file", "reference picture"


@dataclass(frozen=True)
class Content:
    """The content of the subject's files, when they were last read without an error.

    Attributes
    ----------
    loaded : the content
    handles : run values of its numeric parameters, by name
    """

    loaded: Loaded
    handles: Mapping[str, Value] = field(default_factory=dict)

    def values(self, settings: Settings) -> dict[str, Any]:
        """Return the value of each parameter: its control's, else the default."""
        known = {control.name for control in self.loaded.controls}
        moved = {name: value for name, value in settings.values.items() if name in known and value is not None}
        return _defaults(self.loaded) | moved


@dataclass(frozen=True)
class ProgramSet:
    """Compiled programs by slot, the content they were compiled from, and the key of the settings they depend on."""

    content: Content
    key: object
    programs: Mapping[str, Compiled]

    def close(self) -> None:
        for compiled in self.programs.values():
            compiled.close()


class SubjectPrograms:
    """The programs of a subject, and the backends that they run on."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        #: None until the files are read, and after a change; `current` stays until the next one is compiled.
        self._content: Content | None = None
        self.current: ProgramSet | None = None
        #: Open backends by name; consecutive programs share a backend, and so keep history.
        self._backends: dict[str, Backend] = {}
        self.reference: NDArray[Any] | None = None

    @property
    def content(self) -> Content | None:
        """Return the content of the files, or what it was before they changed."""
        return self._content or (None if self.current is None else self.current.content)

    def reload(self) -> None:
        """Read the files again before programs are compiled."""
        self._content = None

    def compiled(self, settings: Settings, *, again: bool) -> ProgramSet:
        """Return the programs for the settings; with ``again`` they are new in any case."""
        if self._content is None:
            loaded = self.subject.load()
            self._content = Content(loaded, run_values_of(loaded, Content(loaded).values(settings)))
        content = self._content
        fixed = {name: value for name, value in content.values(settings).items() if name not in content.handles}
        others = [settings.other] if settings.other and settings.compare else []
        key = (repr(sorted(fixed.items())), settings.target, settings.backend, *others)
        earlier = self.current
        if earlier is not None and earlier.content is content and earlier.key == key and not again:
            return earlier
        drawing = content.loaded.draw({**fixed, **content.handles})
        programs: dict[str, Compiled] = {}
        try:
            programs["a"] = Compiled(drawing, settings.target, self._backend(settings.backend))
            for other in others:
                programs["b"] = self._compared(drawing, programs["a"].target, settings, other)
        except BaseException:
            ProgramSet(content, key, programs).close()
            raise
        for slot, program in ({} if earlier is None else earlier.programs).items():
            if slot in programs:
                programs[slot].follow(program)
            else:
                program.close()
        self.current = ProgramSet(content, key, programs)
        return self.current

    def close(self) -> None:
        if self.current is not None:
            self.current.close()
        self.current = None
        for backend in self._backends.values():
            backend.close()

    def _backend(self, name: str) -> Backend:
        if name not in self._backends:
            self._backends[name] = open_backend(name or None)
        return self._backends[name]

    def _compared(self, drawing: Drawing, target: Target, settings: Settings, other: str) -> Compiled:
        """Compile the drawing on another backend, or a picture file that is shown like the target."""
        if other != REFERENCE_FILE:
            return Compiled(drawing, settings.target, self._backend(other))
        if self.reference is None:
            raise InputError("choose a picture to compare with")
        height, width, channels = self.reference.shape
        picture = Input(REFERENCE_INPUT, format_of(self.reference.dtype, channels), (width, height))
        reference = Drawing({target.name: picture}, (width, height), {REFERENCE_INPUT: self.reference})
        return Compiled(reference, "", self._backend(settings.backend))


def _defaults(loaded: Loaded) -> dict[str, Any]:
    return {control.name: control.default for control in loaded.controls if control.default is not None}
