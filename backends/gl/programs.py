"""Linked programs, compiled once for each pair of shaders; uniforms are sent only when they change."""

from __future__ import annotations

import ctypes
import re
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias
from weakref import WeakValueDictionary, finalize

from passgraph.backends.base import Block
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.counts_source import counting_dialect, counts_text, sums_text
from passgraph.backends.gl.dialect import Dialect, dialect_of
from passgraph.backends.gl.glsl import GLSL, NAMES, in_vectors, region_name
from passgraph.backends.gl.textures import ALL_PLAIN, Objects, Placements, Texture
from passgraph.backends.printing import Listing, kept
from passgraph.backends.shader_printing import vec4_count
from passgraph.cached import Recent
from passgraph.errors import BackendError
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.scalar import ScalarProgram
from passgraph.language.source import NOWHERE
from passgraph.plan.data import CountStep

#: Formats of line numbers in drivers' messages: "0:12(5): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12:"
#: (others).
_LINE = re.compile(r"\b\d+[:(](\d+)[):(]")
#: Most programs that are kept for sources that come again, beside those in use.
MOST_KEPT = 128
Key: TypeAlias = "tuple[str, str, tuple[BuiltinName, ...], Placements]"


@dataclass
class StageUniforms:
    """Locations of one stage's blocks, and the bytes sent last."""

    floats: int
    ints: int
    float_count: int
    int_count: int
    sent_floats: bytes = b""
    sent_ints: bytes = b""


@dataclass
class LinkedProgram:
    """A linked program and its uniforms."""

    name: int
    stages: dict[str, StageUniforms] = field(default_factory=dict)
    output_size: int = -1
    output_origin: int = -1
    guard: int = -1
    #: By unit: location of the uniform with the part of its texture that an image occupies.
    regions: list[int] = field(default_factory=list)
    sent_size: tuple[int, int] = (0, 0)
    sent_guard: int = 0

    def send(self, gl: Any, stage: str, block: Block) -> None:
        """Send a stage's block; the program is in use."""
        own = self.stages[stage]
        if own.float_count:
            data = block.floats.tobytes()
            if data != own.sent_floats:
                _send(gl.Uniform1fv, gl.Uniform4fv, own.floats, own.float_count, data)
                own.sent_floats = data
        if own.int_count:
            data = block.ints.tobytes()
            if data != own.sent_ints:
                _send(gl.Uniform1iv, gl.Uniform4iv, own.ints, own.int_count, data)
                own.sent_ints = data

    def send_size(self, gl: Any, size: tuple[int, int]) -> None:
        if self.output_size >= 0 and size != self.sent_size:
            gl.Uniform2i(self.output_size, *size)
            self.sent_size = size

    def send_parts(self, gl: Any, outputs: Sequence[Texture], images: Sequence[Texture]) -> None:
        """Send the origins and sizes of pictures that are parts of textures."""
        if self.output_origin >= 0:
            gl.Uniform2i(self.output_origin, *outputs[0].origin)
        for location, image in zip(self.regions, images, strict=False):
            if location >= 0:
                gl.Uniform4i(location, *image.origin, *image.size)

    def send_guard(self, gl: Any, times: int) -> None:
        """Send the factor of clip coordinates for a viewport that is ``times`` larger than the target."""
        if times != self.sent_guard:
            gl.Uniform1f(self.guard, 1 / times)
            self.sent_guard = times


class Programs:
    """The programs of one backend, by cache key: those in use, and the most recent ones."""

    def __init__(self, objects: Objects) -> None:
        self.objects = objects
        self.dialect = dialect_of(objects.gl.has)
        self.made: WeakValueDictionary[Key, LinkedProgram] = WeakValueDictionary()
        self._recent = Recent[Key, LinkedProgram](MOST_KEPT)
        #: Names of programs that are no longer in use. They are deleted at the next compilation, in its context.
        self._unused: deque[int] = deque()

    def _once(self, key: Key, link: Callable[[], LinkedProgram]) -> LinkedProgram:
        found = self.made.get(key)
        if found is None:
            found = self.made[key] = self._recent[key] = link()
        return found

    def _shader(self, program: ScalarProgram, varyings: tuple[BuiltinName, ...], placements: Placements) -> Listing:
        given = varyings, placements, self.dialect
        return kept(lambda: GLSL(program, *given).shader(), "glsl", program.key, *given)

    def pixel(self, program: ScalarProgram, placements: Placements = ALL_PLAIN) -> LinkedProgram:
        def link() -> LinkedProgram:
            fragment = self._shader(program, (), placements)
            return self._link(Listing(self.dialect.fullscreen, (NOWHERE,)), fragment, (program,))

        return self._once(("", program.key, (), placements), link)

    def from_text(self, name: str, text: str) -> LinkedProgram:
        """Compile a fragment shader without a kernel; ``name`` is for errors."""
        fragment = Listing(f"{self.dialect.header}\n{text}", (NOWHERE,))
        stages = {g.VERTEX_SHADER: Listing(self.dialect.fullscreen, (NOWHERE,)), g.FRAGMENT_SHADER: fragment}
        return self._linked(stages, (), name)

    def counting(self, step: CountStep, placements: Placements, group: int) -> LinkedProgram:
        """Return a compute program that counts the numbers of a picture in bins."""

        def link() -> LinkedProgram:
            shader = counts_text(step.bins, group, placements.placement(0), self._counting_dialect("compute"))
            return self._linked({g.COMPUTE_SHADER: Listing(shader, (NOWHERE,))}, (step.program,))

        return self._once((f"{step.bins} in groups of {group}", "", (), placements), link)

    def sums(self, step: CountStep, placements: Placements) -> LinkedProgram:
        """Return the linked program that writes the counts."""

        def link() -> LinkedProgram:
            dialect = self._counting_dialect("fragment")
            shader = sums_text(step.bins, placements.output, dialect)
            full = Listing(dialect.fullscreen, (NOWHERE,))
            return self._link(full, Listing(shader, (NOWHERE,)), (step.program,))

        return self._once((f"sums {step.bins}", "", (), placements), link)

    def _counting_dialect(self, stage: str) -> Dialect:
        return counting_dialect(self.dialect, self.objects.gl.has.version >= (4, 3), stage)

    def draw(
        self,
        vertex: ScalarProgram,
        fragment: ScalarProgram | None,
        varyings: tuple[BuiltinName, ...],
        placements: Placements = ALL_PLAIN,
    ) -> LinkedProgram:

        def link() -> LinkedProgram:
            count = len(vertex.images)
            first = self._shader(vertex, varyings, Placements(placements.images[:count]))
            if fragment is None:
                return self._link(first, Listing(self.dialect.no_colour, (NOWHERE,)), (vertex,))
            second = self._shader(fragment, varyings, Placements(placements.images[count:]))
            return self._link(first, second, (vertex, fragment))

        return self._once((vertex.key, "" if fragment is None else fragment.key, varyings, placements), link)

    def _link(self, vertex: Listing, fragment: Listing, programs: tuple[ScalarProgram, ...]) -> LinkedProgram:
        return self._linked({g.VERTEX_SHADER: vertex, g.FRAGMENT_SHADER: fragment}, programs)

    def _linked(
        self, stages: dict[int, Listing], programs: tuple[ScalarProgram, ...], name_in_errors: str = ""
    ) -> LinkedProgram:
        kernel_names = name_in_errors or " and ".join(p.name for p in programs)
        gl = self.objects.gl
        shaders: list[int] = []
        name = gl.CreateProgram()
        self.objects.alive.add(("Program", name))
        # After the new name, so that it is none of these: the context's state remembers the name in use.
        while self._unused:
            self.objects.delete("Program", self._unused.popleft())
        try:
            for kind, listing in stages.items():
                shaders.append(self._compile(kind, listing, programs[-1].name if programs else kernel_names))
                gl.AttachShader(name, shaders[-1])
            gl.LinkProgram(name)
            if not _status(gl.GetProgramiv, name, g.LINK_STATUS):
                log = _log(gl.GetProgramiv, gl.GetProgramInfoLog, name)
                raise BackendError(f"{gl.backend}: the driver cannot link {kernel_names}: {log}")
        except BackendError:
            self.objects.delete("Program", name)
            raise
        finally:
            for shader in shaders:
                gl.DeleteShader(shader)
        linked = self._described(name, programs)
        finalize(linked, self._unused.append, name).atexit = False
        return linked

    def _compile(self, kind: int, listing: Listing, kernel: str) -> int:
        gl = self.objects.gl
        shader: int = gl.CreateShader(kind)
        source = ctypes.c_char_p(listing.text.encode())
        gl.ShaderSource(shader, 1, ctypes.byref(source), None)
        gl.CompileShader(shader)
        if not _status(gl.GetShaderiv, shader, g.COMPILE_STATUS):
            log = _log(gl.GetShaderiv, gl.GetShaderInfoLog, shader)
            gl.DeleteShader(shader)
            raise BackendError(pointed(log, listing, kernel))
        return shader

    def _described(self, name: int, programs: tuple[ScalarProgram, ...]) -> LinkedProgram:
        gl, linked, unit = self.objects.gl, LinkedProgram(name), 0
        gl.UseProgram(name)
        for program in programs:
            names = NAMES[program.stage]
            linked.stages[program.stage] = StageUniforms(
                gl.GetUniformLocation(name, names.floats.encode()),
                gl.GetUniformLocation(name, names.ints.encode()),
                program.float_count,
                program.int_count,
            )
            for k in range(len(program.images)):
                gl.Uniform1i(gl.GetUniformLocation(name, f"{names.image}{k}".encode()), unit)
                linked.regions.append(gl.GetUniformLocation(name, region_name(names.image, k).encode()))
                unit += 1
        linked.output_origin = gl.GetUniformLocation(name, b"pg_output_origin")
        linked.output_size = gl.GetUniformLocation(name, b"pg_output_size")
        linked.guard = gl.GetUniformLocation(name, b"pg_guard")
        gl.UseProgram(0)
        return linked


def pointed(log: str, listing: Listing, kernel: str) -> str:
    """Return a driver's message with the kernel line behind the first generated line that it names."""
    first = next((line for line in log.splitlines() if line.strip()), "no message")
    match = _LINE.search(first)
    message = f"the OpenGL driver refuses kernel {kernel}: {first.strip()}"
    if match is None:
        return f"gl: {message}"
    return listing.span_at(int(match.group(1))).point_at(message)


def _send(scalars: Any, vectors: Any, location: int, count: int, data: bytes) -> None:
    if in_vectors(count):
        vectors(location, vec4_count(count), data.ljust(16 * vec4_count(count), b"\0"))
    else:
        scalars(location, count, data)


def _status(query: Any, name: int, what: int) -> int:
    value = ctypes.c_int(0)
    query(name, what, ctypes.byref(value))
    return value.value


def _log(query: Any, read: Any, name: int) -> str:
    size = max(1, _status(query, name, g.INFO_LOG_LENGTH))
    text = ctypes.create_string_buffer(size)
    read(name, size, None, text)
    return text.value.decode(errors="replace").strip()
