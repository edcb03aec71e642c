"""libretro presets: what their keys mean, held against the original on OpenGL and against NumPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from original_libretro import Chain, Drawn, Picture

import passgraph as pg
from passgraph.errors import InputError, KernelError
from passgraph.shaders.containers.libretro import MAX_CLIMB, _Values

_BOTH = """
#pragma parameter GAIN "Gain" 1.0 0.0 4.0 0.1
#if defined(VERTEX)
in vec4 VertexCoord; in vec4 TexCoord; in vec4 COLOR;
out vec4 TEX0; out vec2 near[2];
uniform mat4 MVPMatrix; uniform vec2 TextureSize;
struct Same { float a; float same; };
float same(float x) { return x * 2.0; }
void main() {
    gl_Position = MVPMatrix * VertexCoord;
    TEX0 = TexCoord * COLOR;
    Same it = Same(same(0.5), 0.0);
    near[0] = TexCoord.xy - vec2(it.a, 0.0) / TextureSize;
    near[1] = TexCoord.xy + vec2(0.0, it.a) / TextureSize;
}
#elif defined(FRAGMENT)
in vec4 TEX0; in vec2 near[2];
out vec4 FragColor;
uniform sampler2D Texture;
uniform int FrameCount, FrameDirection;
uniform vec2 OutputSize; uniform vec2 InputSize; uniform vec2 TextureSize;
uniform float GAIN;
%s
struct Same { vec3 other; };
vec4 same(vec2 at) { return texture(Texture, at); }
vec2 early = TEX0.xy;
void main() { FragColor = GAIN * (%s); }
#endif
"""
_MIXED = "0.5 * same(TEX0.xy) + 0.25 * same(near[0]) + 0.25 * same(near[1])"


def picture(seed: int, height: int = 6, width: int = 9) -> Picture:
    """Random bytes, opaque."""
    found = np.random.default_rng(seed).integers(0, 256, (height, width, 4)).astype(np.float32) / np.float32(255)
    found[..., 3] = 1.0
    return found


def shader(value: str, more: str = "") -> str:
    return _BOTH % (more, value)


def effect(folder: Path, preset: str, **texts: str) -> pg.shaders.containers.effect.ShaderEffect:  # type: ignore[name-defined]
    for name, text in texts.items():
        (folder / f"{name}.glsl").write_text(text)
    (folder / "a.glslp").write_text(preset)
    return pg.load_shader(folder / "a.glslp")


def run(made, frames: list[Picture], scale: float = 2.0, backend: str = "reference", **values: float) -> list[Picture]:  # type: ignore[no-untyped-def]
    graph = made(pg.Input("frame"), into=pg.target("out", "rgba32f"), output_scale=scale, **values)
    height, width = frames[0].shape[:2]
    program = pg.compile(graph, size=(width, height), backend=backend)
    return [np.array(program(frame=one)["out"]) for one in frames]


@pytest.mark.parametrize(
    ("wrap", "border", "linear"),
    [("clamp_to_border", "zero", True), ("clamp_to_edge", "clamp", True), ("repeat", "repeat", False)],
)
def test_both_halves_mean_what_they_do_on_opengl(tmp_path, context, wrap: str, border: str, linear: bool) -> None:
    """Varyings of a vertex half, its own functions and types, sizes, filters, borders."""
    frame = picture(1)
    texts = {"one": shader(_MIXED), "two": shader("0.5 * same(early * 1.3 - 0.11) + 0.5 * same(near[0])")}
    preset = f"""
        shaders = "2" // two of them
        shader0 = one.glsl
        shader1 = "two.glsl"
        wrap_mode1 = {wrap}
        filter_linear1 = {str(linear).lower()}
        scale_type_x0 = source
        scale_x0 = 2.0
        scale_type_y0 = absolute
        scale_y0 = 7
        float_framebuffer0 = true
    """
    found = run(effect(tmp_path, preset, **texts), [frame], backend="numpy")[0]
    first, second = Drawn(texts["one"], (18, 7), format="rgba32f"), Drawn(texts["two"], (18, 12), linear, border)
    expected = Chain(context, (first, second), values={"GAIN": 1.0}).frame(frame, 0)
    assert found.shape == (12, 18, 4)
    assert np.abs(found - expected).max() < 1e-4


@pytest.mark.parametrize("format_", ["rgba8", "rgba8_srgb", "rgba32f"])
def test_passes_keep_what_their_formats_keep(tmp_path, context, format_: str) -> None:
    frame = picture(2)
    key = {"rgba8": "", "rgba8_srgb": "srgb_framebuffer0 = true", "rgba32f": "float_framebuffer0 = true"}[format_]
    texts = {"one": shader("same(TEX0.xy) * 1.7 - 0.2"), "two": shader("same(TEX0.xy)")}
    found = run(effect(tmp_path, f"shaders = 2\nshader0 = one.glsl\nshader1 = two.glsl\n{key}", **texts), [frame], 1.0)[
        0
    ]
    drawn = (Drawn(texts["one"], (9, 6), format=format_), Drawn(texts["two"], (9, 6)))
    expected = Chain(context, drawn, values={"GAIN": 1.0}).frame(frame, 0)
    step = {"rgba8": 1.01 / 255, "rgba8_srgb": 2.4 / 255, "rgba32f": 1e-5}[format_]  # of sRGB, where it is steepest
    assert np.abs(found - expected).max() < step
    assert (found[..., :3].max() > 1.0) == (format_ == "rgba32f")


@pytest.mark.parametrize("linear", [False, True])
def test_passes_and_textures_have_the_levels_that_presets_ask_for(tmp_path, context, linear: bool) -> None:
    """The frame, what a pass made, and a texture, all by names too; no level where none is asked for."""
    frame, lut, said = picture(6, 8, 16), picture(7, 16, 16), str(linear).lower()
    pg.save(tmp_path / "lut.png", lut)
    more = "uniform sampler2D LUT, OLD, OrigTexture;"
    reads = """0.4 * same(TEX0.xy * 3.1) + 0.3 * texture(LUT, TEX0.xy * 3.1, 0.5) + 0.2 * texture(OLD, TEX0.xy * 3.1)
        + 0.1 * textureLod(OrigTexture, TEX0.xy, 2.5)"""
    texts = {"one": shader("same(TEX0.xy * 2.3)"), "two": shader(reads, more)}
    preset = f"""
        shaders = 2
        shader0 = one.glsl
        shader1 = two.glsl
        mipmap_input0 = true
        mipmap_input1 = true
        filter_linear0 = {said}
        filter_linear1 = {said}
        float_framebuffer0 = true
        textures = "LUT;OLD"
        LUT = lut.png
        LUT_mipmap = true
        LUT_linear = {said}
        OLD = lut.png
        OLD_linear = {said}
    """
    found = run(effect(tmp_path, preset, **texts), [frame], 1.0)[0]
    drawn = [Drawn(text, (16, 8), linear, format="rgba32f", mipmaps=True) for text in texts.values()]
    textures = {name: (lut, linear, "zero", name == "LUT") for name in ("LUT", "OLD")}
    expected = Chain(context, drawn, textures, values={"GAIN": 1.0}).frame(frame, 0)
    assert np.abs(found - expected).max() < (0.03 if linear else 1e-5)
    without = run(effect(tmp_path, preset.replace("mipmap", "no_mipmap"), **texts), [frame], 1.0)[0]
    assert np.abs(found - without).max() > 0.1


def test_earlier_frames_are_those_of_earlier_runs(tmp_path) -> None:
    more = "uniform sampler2D PrevTexture; uniform sampler2D Prev6Texture;"
    text = shader("vec4(texture(PrevTexture, TEX0.xy).x, texture(Prev6Texture, TEX0.xy).x, same(TEX0.xy).x, 1.0)", more)
    frames = [picture(seed) for seed in range(9)]
    found = run(effect(tmp_path, "shaders = 1\nshader0 = one.glsl", one=text), frames, 1.0)
    for number, shown in enumerate(found):
        expected = np.zeros((*frames[0].shape[:2], 3), np.float32)
        expected[..., 2] = frames[number][..., 0]
        for channel, ago in ((0, 1), (1, 7)):
            if number >= ago:
                expected[..., channel] = frames[number - ago][..., 0]
        assert np.array_equal(shown[..., :3], expected), number


def test_feedback_is_what_a_pass_made_in_the_run_before(tmp_path) -> None:
    more = "uniform sampler2D FeedbackTexture;"
    texts = {"one": shader("0.5 * same(TEX0.xy) + 0.5 * texture(FeedbackTexture, TEX0.xy)", more)}
    preset = "shaders = 2\nshader0 = one.glsl\nshader1 = two.glsl\nfeedback_pass = 0\nfloat_framebuffer0 = true"
    frames = [picture(seed) for seed in range(4)]
    found = run(effect(tmp_path, preset, two=shader("same(TEX0.xy)"), **texts), frames, 1.0)
    held = np.zeros_like(frames[0])
    for frame, shown in zip(frames, found, strict=True):
        held = 0.5 * frame + 0.5 * held
        assert np.abs(shown - held).max() < 1e-6


def test_a_tube_that_glows_on_does_so_as_the_original_does(tmp_path, context) -> None:
    """Feedback of a pass, frames before, and the mean brightness of a picture from its last level, over six frames."""
    glow = shader(
        "max(same(TEX0.xy), 0.7 * texture(FeedbackTexture, TEX0.xy)) + 0.1 * texture(Prev1Texture, TEX0.xy)",
        "uniform sampler2D FeedbackTexture, Prev1Texture;",
    )
    tube = shader(
        """same(TEX0.xy + 0.03 * sin(9.0 * TEX0.yx)) * (0.7 + 0.3 * sin(6.2832 * TEX0.y * OutputSize.y / 3.0))
           / (0.5 + textureLod(Texture, vec2(0.5), 9.0).g)"""
    )
    preset = """
        shaders = 2
        shader0 = glow.glsl
        float_framebuffer0 = true
        feedback_pass = 0
        shader1 = tube.glsl
        filter_linear1 = true
        mipmap_input1 = true
        wrap_mode1 = clamp_to_edge
    """
    frames = [np.roll(picture(9, 8, 16), 3 * step, axis=1) * (step < 3) for step in range(6)]
    found = run(effect(tmp_path, preset, glow=glow, tube=tube), frames)
    drawn = (Drawn(glow, (16, 8), format="rgba32f"), Drawn(tube, (32, 16), True, "clamp", mipmaps=True))
    chain = Chain(context, drawn, feedback=0, values={"GAIN": 1.0})
    for number, (shown, frame) in enumerate(zip(found, frames, strict=True)):
        expected = chain.frame(np.ascontiguousarray(frame, np.float32), number)
        assert np.abs(shown - expected).max() < 0.02, number
    assert found[-1].max() > 0.1, "nothing glows"


def test_passes_textures_and_frames_have_their_names(tmp_path) -> None:
    """Orig, PassN from 1, PassPrevN back from here, aliases, textures of the preset, and sizes of each."""
    pixel = np.full((1, 1, 3), 128 / 255, np.float32)
    pg.save(tmp_path / "lut.png", pixel)
    more = """uniform sampler2D OrigTexture, Pass1Texture, PassPrev1Texture, halfTexture, LUT, nobody;
              uniform vec2 halfTextureSize;"""
    text = shader(
        """vec4(texture(OrigTexture, TEX0.xy).x - texture(PassPrev3Texture, TEX0.xy).x,
             texture(Pass1Texture, TEX0.xy).x - 2.0 * texture(halfTexture, TEX0.xy).x, texture(LUT, TEX0.xy).x,
             halfTextureSize.x + OutputSize.y / 100.0 + texture(nobody, TEX0.xy).x - same(TEX0.xy).x)""",
        more + "uniform sampler2D PassPrev3Texture;",
    )
    preset = """
        shaders = 3
        shader0 = same.glsl
        shader1 = half.glsl
        shader2 = last.glsl
        alias1 = half
        float_framebuffer0 = true
        float_framebuffer1 = true
        textures = LUT
        LUT = lut.png
        LUT_wrap_mode = repeat
    """
    same, half = shader("same(TEX0.xy)"), shader("0.5 * same(TEX0.xy)")
    shown = run(effect(tmp_path, preset, same=same, half=half, last=text), [picture(3)], 1.0)[0]
    assert np.abs(shown - np.array([0, 0, 128 / 255, 9.06])).max() < 1e-5


def test_parameters_come_from_pragmas_and_presets_override_them(tmp_path) -> None:
    made = effect(tmp_path, "shaders = 1\nshader0 = one.glsl\nparameters = GAIN\nGAIN = 0.5", one=shader("vec4(1.0)"))
    told = made.parameters["GAIN"]
    assert (told.default, told.low, told.high, told.label) == (0.5, 0.0, 4.0, "Gain")
    assert run(made, [picture(1)])[0][0, 0, 0] == 0.5
    assert run(made, [picture(1)], GAIN=2.0)[0][0, 0, 0] == 2.0
    with pytest.raises(InputError, match=r"from 0\.0 to 4\.0"):
        run(made, [picture(1)], GAIN=5.0)


def test_frames_are_counted_up_to_the_modulus(tmp_path) -> None:
    texts = {"one": shader("vec4(float(FrameCount), float(FrameDirection), 0.0, 1.0)")}
    made = effect(tmp_path, "shaders = 1\nshader0 = one.glsl\nframe_count_mod0 = 3.0", **texts)
    assert [shown[0, 0, 0] for shown in run(made, [picture(1)] * 5)] == [0, 1, 2, 0, 1]


def test_a_preset_may_lack_what_the_player_does_without(tmp_path) -> None:
    """The last quotation mark, and an end to digits."""
    pg.save(tmp_path / "lut.png", np.ones((1, 1, 3), np.float32))
    more = "uniform sampler2D LUT;"
    preset = (
        'shaders = 1_\nshader0 = "one.glsl\nscale_type0 = absolute\nscale0 = 5.0\ntextures = "LUT;\nLUT = \'lut.png'
    )
    made = effect(tmp_path, preset, one=shader("texture(LUT, TEX0.xy)", more))
    assert run(made, [picture(1)], 1.0)[0].tolist() == np.ones((5, 5, 4)).tolist()


def test_a_preset_goes_before_what_it_refers_to(tmp_path) -> None:
    (tmp_path / "base").mkdir()
    (tmp_path / "base" / "b.glslp").write_text("shaders = 1\nshader0 = ../one.glsl\nGAIN = 3.0\nfilter_linear0 = true")
    made = effect(tmp_path, '#reference "base/b.glslp"\nGAIN = 2.0\n# shaders = 4', one=shader("vec4(1.0)"))
    assert made.parameters["GAIN"].default == 2.0


def test_files_of_a_preset_lie_some_folders_above_it_but_never_under_the_root_alone(tmp_path) -> None:
    (tmp_path / "one.glsl").write_text(shader("vec4(1.0)"))
    for depth in range(1, MAX_CLIMB + 2):
        preset = tmp_path.joinpath(*"abcde"[:depth], "p.glslp")
        preset.parent.mkdir(exist_ok=True)
        preset.write_text(f"shaders = 1\nshader0 = {'../' * depth}one.glsl")
        if depth <= MAX_CLIMB:
            assert pg.load_shader(preset).kind == "libretro"
    with pytest.raises(InputError, match="lies outside"):
        pg.load_shader(preset)
    assert _Values(Path("/top/p.glslp"), {}).root == Path("/top")
    assert _Values(Path("/top/below/p.glslp"), {}).root == Path("/top")


def test_a_shader_by_itself_is_one_pass(tmp_path) -> None:
    (tmp_path / "one.glsl").write_text(shader("same(TEX0.xy)"))
    made = pg.load_shader(tmp_path / "one.glsl")
    frame = picture(4)
    assert (made.kind, made.images) == ("libretro", ("frame",))
    assert np.array_equal(run(made, [frame], 3.0)[0], frame.repeat(3, 0).repeat(3, 1))


def test_a_half_that_moves_the_picture_moves_it(tmp_path, context) -> None:
    """Half as large and a little aside; nothing is drawn around it."""
    text = shader("same(TEX0.xy) + 0.1").replace(
        "MVPMatrix * VertexCoord", "vec4(0.21, -0.12, 0, 0) + vec4(0.5, 0.5, 1, 1) * (MVPMatrix * VertexCoord)"
    )
    frame = picture(5, 8, 8)
    found = run(effect(tmp_path, "shaders = 1\nshader0 = one.glsl", one=text), [frame])[0]
    expected = Chain(context, (Drawn(text, (16, 16)),), values={"GAIN": 1.0}).frame(frame, 0)
    assert np.abs(found - expected).max() < 1e-5
    assert 40 < (found[..., 3] > 0).sum() < 100


_ONE = "shaders = 1\nshader0 = one.glsl\n"


@pytest.mark.parametrize(
    ("preset", "says"),
    [
        ("#reference a.glslp\n", "in a circle"),
        ("#reference gone.glslp\n", "gone.glslp"),
        ("shaders = 1\n", "shader0 is missing"),
        ("shaders = 1\nshader0 = gone.glsl", "gone.glsl"),
        ("shaders = 1\nshader0 = /etc/hostname", "lies outside"),
        ("shaders = 1\nshader0 = C:/one.glsl", "lies outside"),
        ("shaders = 1\nshader0 = " + "../" * 12 + "etc/hostname", "lies outside"),
        ("shaders = 1\nshader0 = .", "directory"),
        ("shaders = 65\n", "shaders is a number from 1 to 64, got '65'"),
        ("shaders = 0\n", "from 1 to 64"),
        (_ONE + "scale_type0 = source\nscale0 = 0", "scale0 is a number from 0.015625 to 64, got '0'"),
        (_ONE + "scale_type0 = source\nscale0 = 1e9", "got '1e9'"),
        (_ONE + "scale_type0 = source\nscale0 = nan", "got 'nan'"),
        (_ONE + "scale_type0 = absolute\nscale0 = 1000000", "scale0 is a number from 1 to 32768"),
        (_ONE + "scale_type0 = absolute\nscale0 = inf", "got 'inf'"),
        (_ONE + "scale_type0 = window", "one of source, viewport, absolute, got 'window'"),
        (_ONE + "wrap_mode0 = sideways", "wrap_mode0 is one of"),
        (_ONE + "filter_linear0 = perhaps", "one of true, 1, false, 0"),
        (_ONE + "feedback_pass = 1", "feedback_pass is a number from -1 to 0"),
        (_ONE + "textures = LUT", "LUT is missing"),
        (_ONE + "textures = LUT\nLUT = gone.png", "gone.png"),
        (_ONE + "textures = " + ";".join(f"L{i}" for i in range(33)), "at most 32 textures"),
        (_ONE + "alias0 = a b", "alias0 is a name"),
        ("shaders = 1\nshader0 = half.glsl", "has not both halves"),
        ("shaders = 1\nshader0 = turned.glsl", "vertex shader hands on floats"),
        ("shaders = 1\nshader0 = sized.glsl", "size of no picture"),
        ("shaders = 1\nshader0 = bad.glsl", r"bad.glsl"),
    ],
)
def test_a_wrong_preset_is_refused(tmp_path, preset: str, says: str) -> None:
    one = shader("vec4(1.0)")
    texts = {
        "one": one,
        "half": "#if defined(VERTEX)\n#endif\nvoid main() {}",
        "turned": one.replace("out vec4 TEX0", "out ivec2 turn; out vec4 TEX0"),
        "sized": one.replace("uniform vec2 OutputSize", "uniform vec2 Pass9TextureSize; uniform vec2 OutputSize"),
        "bad": one.replace("Same it", "Other it"),
    }
    with pytest.raises((InputError, KernelError), match=says):
        effect(tmp_path, preset, **texts)


def test_a_link_out_of_the_tree_is_refused(tmp_path) -> None:
    (tmp_path / "1/2/3/4/5").mkdir(parents=True)
    (tmp_path / "secret.glsl").write_text(shader("vec4(1.0)"))
    folder = tmp_path / "1/2/3/4/5"
    (folder / "one.glsl").symlink_to(tmp_path / "secret.glsl")
    with pytest.raises(InputError, match="lies outside"):
        effect(folder, _ONE)


def test_sizes_that_share_a_declaration_are_the_players(tmp_path: Path) -> None:
    text = shader("vec4(OutputSize / 32.0, shift + TextureSize / 16.0)")
    apart = "uniform vec2 OutputSize; uniform vec2 InputSize; uniform vec2 TextureSize;"
    assert apart in text
    for together in (
        "uniform vec2 OutputSize, InputSize, shift, TextureSize;",
        "uniform vec2 shift, OutputSize, TextureSize;",
    ):
        made = effect(tmp_path, "shaders = 1\nshader0 = a.glsl", a=text.replace(apart, together))
        assert (run(made, [picture(1, 4, 8)])[-1] == [0.5, 0.25, 0.5, 0.25]).all()
