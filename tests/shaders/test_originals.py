"""Published shader files draw what the original GLSL draws on OpenGL."""

from __future__ import annotations

import moderngl
import pytest
from beside import FOLDER, MISSING, STEPS, Case, apart, files, read_original, values_of
from defined import used
from originals import IsfFile, TransitionFile

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.shaders.containers.isf import read_header
from passgraph.shaders.shader_file import load_shader

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=MISSING)

#: What each stands for.
CHOSEN = {
    "isf/Bloom.fs": "passes of other sizes, a vertex shader with an array",
    "isf/Edge Distort.fs": "a vertex shader",
    "isf/Comet Tails.fs": "a persistent buffer of floats that the last pass writes",
    "isf/Etch-a-Sketch.fs": "events, a persistent buffer of bytes",
    "isf/Color History.fs": "several persistent buffers",
    "isf/Cursor Overlay.fs": "an imported picture",
    "isf/Test Pattern Generator.fs": "a long with labels",
    "isf/Twirl.fs": "a default beyond its range",
    "isf/Checkerboard.fs": "no picture",
    "transitions/Bounce.glsl": "defaults behind comments",
    "transitions/displacement.glsl": "a third picture",
    "transitions/Swirl.glsl": "nothing but progress",
}

#: Files that make noise of a function's last digits or rely on what GLSL leaves open: the function, a seed of values.
SETTLED = {
    "isf/Dirty Lens.fs": ("pow", 0),
    "isf/Perlin Transition.fs": ("mod", 2),
    "isf/VHS Glitch.fs": ("dot", 2),
    "transitions/BookFlip.glsl": ("texture", 0),
}


@pytest.mark.sampled
@pytest.mark.parametrize("name", CHOSEN)
@pytest.mark.parametrize("size", [(64, 48), (53, 31)])
def test_chosen_file_draws_what_the_original_draws(name: str, size: tuple[int, int], context: moderngl.Context) -> None:
    frames = 4 if read_original(FOLDER / name).persistent else 1
    seed = 1 if size[0] % 2 else 0
    case = Case(FOLDER / name, size, seed, frames)
    drawn = case.original(context)
    assert max(float(picture.max() - picture.min()) for picture in drawn) > 0.1, "a plain picture shows nothing"
    assert apart(drawn, case.ours()).agrees


@pytest.mark.parametrize("backend", ["gl", "opencl"])
def test_backends_draw_what_the_original_draws(backend: str, context: moderngl.Context) -> None:
    for name in ("isf/Comet Tails.fs", "transitions/Bounce.glsl"):
        case = Case(FOLDER / name, (40, 24), 1, 2)
        assert apart(case.original(context), case.ours(backend)).agrees, name


def test_a_wrong_parameter_is_seen(context: moderngl.Context) -> None:
    """The comparison can fail."""
    case = Case(FOLDER / "transitions/Bounce.glsl", (40, 24))
    assert not apart(case.original(context), Case(case.path, case.size, 1).ours()).agrees


def test_parameters_of_isf_files_are_those_that_headers_say() -> None:
    for path in files("isf"):
        file = IsfFile(path)
        here, said = read_header(file.text, str(path)).parameters, values_of(file.parameters, 0)
        assert here.keys() == said.keys(), path.name
        given = {one["NAME"] for one in file.header.get("INPUTS", []) if "DEFAULT" in one}
        for name in given & said.keys():
            assert here[name].default == pytest.approx(said[name], rel=1e-6), f"{path.name}: {name}"


@pytest.mark.parametrize("name", ["Bounce", "fadecolor", "fadegrayscale", "PuzzleRight", "TilesWave", "Slides"])
def test_parameters_of_transitions_are_those_that_comments_say(name: str) -> None:
    path = FOLDER / "transitions" / f"{name}.glsl"
    here, said = load_shader(path).parameters, values_of(TransitionFile(path).parameters, 0)
    assert here.keys() == said.keys()
    for key in said:
        assert here[key].default == pytest.approx(said[key], rel=1e-6), key


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["isf", "transitions"])
def test_nearly_every_file_is_read_and_refusals_say_where(kind: str) -> None:
    refused = {}
    for path in files(kind):
        try:
            load_shader(path)
        except (KernelError, pg.InputError) as error:
            refused[path.name] = str(error)
    assert len(refused) <= 0.02 * len(files(kind)), refused
    assert all(name.rpartition(".")[0] in text for name, text in refused.items())


@pytest.mark.parametrize("name", SETTLED)
def test_what_drivers_are_free_in_is_all_that_is_apart(name: str, context: moderngl.Context) -> None:
    """With its functions as kernels define them, an original draws what is drawn here; without one of them, not."""
    alone, seed = SETTLED[name]
    case = Case(FOLDER / name, (53, 31), seed)
    ours, every = case.ours(), used(case.path.read_text(encoding="utf-8"))
    assert apart(case.original(context, every), ours).steps <= STEPS
    assert not apart(case.original(context, [one for one in every if one != alone]), ours).agrees


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["isf", "transitions"])
def test_every_file_draws_what_the_original_draws_with_its_functions_settled(
    kind: str, context: moderngl.Context
) -> None:
    wrong = []
    for path in files(kind):
        try:
            load_shader(path)
        except (KernelError, pg.InputError):
            continue
        case = Case(path, (53, 31), 0, 4 if read_original(path).persistent else 1)
        every = used(path.read_text(encoding="utf-8", errors="replace"))
        if not apart(case.original(context, every), case.ours()).agrees:
            wrong.append(path.name)
    assert len(wrong) <= 0.01 * len(files(kind)), wrong
