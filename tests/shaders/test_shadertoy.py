"""Shadertoy: one pass alone, and exports whose buffers feed each other, held against NumPy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from original_shadertoy import Drawn, Original

import passgraph as pg

BACKENDS = ["reference", "numpy", "gl", "opencl"]
#: Conway's rules on a torus, begun by a pattern of the place.
LIFE = """
void mainImage(out vec4 c, in vec2 f) {
    if (iFrame == 0) { c = vec4(mod(f.x * 7.0 + f.y * 3.0, 5.0) < 2.0 ? 1.0 : 0.0); return; }
    float n = 0.0;
    for (int y = -1; y <= 1; y++) for (int x = -1; x <= 1; x++)
        if (x != 0 || y != 0) n += texture(iChannel0, (f + vec2(x, y)) / iResolution.xy).r;
    float me = texture(iChannel0, f / iResolution.xy).r;
    n = floor(n + 0.5);
    c = vec4(n == 3.0 || (n == 2.0 && me > 0.5) ? 1.0 : 0.0);
}"""
SHOWN = "void mainImage(out vec4 c, in vec2 f) { c = shown(texture(iChannel1, f / iResolution.xy), f); }"
COMMON = "vec4 shown(vec4 c, vec2 f) { return vec4(c.r, f.y, float(iFrame), 1.0); }"


def export(**changed: Any) -> dict[str, Any]:
    wrap = {"filter": "nearest", "wrap": "repeat"}
    passes = [
        {"name": "Image", "type": "image", "code": SHOWN, "outputs": [{"id": "9", "channel": 0}],
         "inputs": [{"channel": 1, "ctype": "buffer", "id": "5", "sampler": wrap}]},
        {"name": "Common", "type": "common", "code": COMMON, "inputs": [], "outputs": []},
        {"name": "Buffer A", "type": "buffer", "code": LIFE, "outputs": [{"id": "5", "channel": 0}],
         "inputs": [{"channel": 0, "ctype": "buffer", "id": "5", "sampler": wrap}]},
    ]  # fmt: skip
    return {"Shader": {"info": {"name": "life", "username": "us"}, "renderpass": passes}} | changed


def written(folder: Path, said: object) -> Path:
    file = folder / "life.json"
    file.write_text(said if isinstance(said, str) else json.dumps(said))
    return file


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_buffer_reads_its_own_last_frame(tmp_path: Path, backend: str) -> None:
    effect = pg.load_shader(written(tmp_path, export()))
    assert (effect.kind, effect.summary, effect.credit, effect.images) == ("Shadertoy", "life", "us", ())
    y, x = np.mgrid[0:9, 0:15]
    alive = ((x + 0.5) * 7 + (y + 0.5) * 3) % 5 < 2  # rows from the bottom
    with pg.compile(effect(into=pg.target("out", "rgba32f")), backend=backend, size=(15, 9)) as program:
        for frame in range(4):
            seen = program()["out"][::-1]
            assert np.array_equal(seen[:, :, 0], alive)
            assert np.array_equal(seen[:, :, 1], y + 0.5)
            assert (seen[:, :, 2] == frame).all()
            around = sum(np.roll(alive, (dy, dx), (0, 1)) for dy in (-1, 0, 1) for dx in (-1, 0, 1)) - alive
            alive = (around == 3) | ((around == 2) & alive)


#: Heights and speeds of waves: each buffer reads both, and the picture the heights alone.
HEIGHTS = """void mainImage(out vec4 c, in vec2 f) {
    ivec2 p = ivec2(f);
    c = iFrame == 0 ? vec4(0.0) : vec4(texelFetch(iChannel0, p, 0).r + 0.5 * texelFetch(iChannel1, p, 0).r);
}"""
SPEEDS = """void mainImage(out vec4 c, in vec2 f) {
    vec2 at = f / iChannelResolution[0].xy, step = 1.0 / iChannelResolution[0].xy;
    float around = 0.0, away = length(f - iMouse.xy);
    for (int i = 0; i < 4; i++) around += texture(iChannel0, at + (i < 2 ? step.x : step.y) * NEXT[i]).r;
    float speed = texture(iChannel1, at).r + 0.2 * (around - 4.0 * texture(iChannel0, at).r);
    c = vec4(speed + 0.01 * iTime * exp(-away * away / 20.0));
}"""
WAVES = "void mainImage(out vec4 c, in vec2 f) { c = texture(iChannel0, f / iResolution.xy).rrrr * 5.0 + 0.5; }"
NEXT = "const vec2 NEXT[4] = vec2[](vec2(1, 0), vec2(-1, 0), vec2(0, 1), vec2(0, -1));"


@pytest.mark.parametrize("backend", BACKENDS)
def test_buffers_that_feed_each_other_draw_what_the_original_draws(
    tmp_path: Path, context: moderngl.Context, backend: str
) -> None:
    sampler = {"filter": "linear", "wrap": "clamp"}
    both = [{"channel": i, "ctype": "buffer", "id": key, "sampler": sampler} for i, key in enumerate("57")]
    passes = [
        {"name": "Image", "type": "image", "code": WAVES, "inputs": both[:1], "outputs": []},
        {"name": "Buffer A", "type": "buffer", "code": HEIGHTS, "inputs": both, "outputs": [{"id": "5"}]},
        {"name": "Buffer B", "type": "buffer", "code": SPEEDS, "inputs": both, "outputs": [{"id": "7"}]},
        {"name": "Common", "type": "common", "code": NEXT, "inputs": [], "outputs": []},
    ]
    effect = pg.load_shader(written(tmp_path, {"Shader": {"renderpass": passes}}))
    size, mouse, seen = (15, 11), (4.0, 7.5, 4.0, 7.5), []
    graph = effect(into=pg.target("out", "rgba32f"), time=0.5, time_step=0.25, iMouse=mouse)
    with pg.compile(graph, backend=backend, size=size) as program:
        seen = [program()["out"] for _ in range(12)]
    channels = {0: "A", 1: "B"}
    drawn = [Drawn("A", HEIGHTS, channels), Drawn("B", SPEEDS, channels), Drawn("Image", WAVES, {0: "A"})]
    original = Original(context, drawn, NEXT, size)
    expected = [original.frame(number, 0.5 + number * 0.25, 0.25, mouse) for number in range(12)]
    assert np.ptp(expected[-1][:, :, 0]) > 0.1, "a plain picture shows nothing"
    np.testing.assert_allclose(seen, expected, atol=2e-6)


def test_one_pass_alone_takes_pictures_as_channels(tmp_path: Path) -> None:
    file = tmp_path / "two.glsl"
    file.write_text(
        "void mainImage(out vec4 c, in vec2 f) {\n"
        "    c = texture(iChannel0, f / iResolution.xy) + vec4(iChannelResolution[1].xy, iTime, iMouse.x);\n}"
    )
    effect = pg.load_shader(file)
    assert effect.images == ("iChannel0", "iChannel1")
    picture = np.random.default_rng(1).random((6, 8, 4)).astype(np.float32)
    other = np.zeros((3, 5, 4), np.float32)
    graph = effect(pg.Input("a"), pg.Input("b"), time=2.0, iMouse=(7.0, 0.0, 0.0, 0.0), into=pg.target("o", "rgba32f"))
    with pg.compile(graph) as program:
        seen = program(a=picture, b=other)["o"]
    np.testing.assert_allclose(seen, picture + np.array([5, 3, 2, 7]), atol=1e-5)


@pytest.mark.parametrize("filter", ["nearest", "linear", "mipmap"])
def test_channels_are_filtered_as_the_export_says(tmp_path: Path, filter: str) -> None:
    """A buffer and a picture from outside: the one texel, four, or those of a smaller level."""
    sampler = {"filter": filter, "wrap": "repeat"}
    said = _first(
        "code",
        """void mainImage(out vec4 c, in vec2 f) {
        vec2 p = f / iResolution.xy, q = p * 4.0 + 0.06;
        c = vec4(texture(iChannel1, q).r, texture(iChannel0, q).r, textureLod(iChannel0, p, 8.0).r, 1.0);
    }""",
    )
    first, _, second = said["Shader"]["renderpass"]
    first["inputs"] = [
        {"channel": 1, "ctype": "buffer", "id": "5", "sampler": sampler},
        {"channel": 0, "ctype": "texture", "id": "7", "sampler": sampler},
    ]
    second["code"] = "void mainImage(out vec4 c, in vec2 f) { c = texelFetch(iChannel0, ivec2(f), 0); }"
    second["inputs"] = [{"channel": 0, "ctype": "texture", "id": "7", "sampler": {"filter": "linear"}}]
    effect = pg.load_shader(written(tmp_path, said))
    given = np.random.default_rng(2).random((8, 8, 4)).astype(np.float32)
    graph = effect(pg.Input("frame").filter("nearest"), into=pg.target("out", "rgba32f"))
    with pg.compile(graph, backend="reference", size=(8, 8)) as program:
        seen = np.array(program(frame=given)["out"])
    if filter == "mipmap":  # 4 texels a pixel: means of 4x4
        means = given.reshape(2, 4, 2, 4, 4).mean(axis=(1, 3))
        assert np.allclose(seen[..., 2], given[..., 0].mean(), atol=1e-6)
    texels = means if filter == "mipmap" else given
    places = (np.mgrid[0:8, 0:8] + 0.5) / 2 + np.array([-0.06, 0.06])[:, None, None]  # rows turned: on a torus
    v, u = (places * len(texels) - 0.5) % len(texels)
    here, beside = (lambda at: np.floor(at).astype(int)), (lambda at: (np.floor(at).astype(int) + 1) % len(texels))
    red, fv, fu = texels[..., 0], v % 1, u % 1
    expected = (red[here(v), here(u)] * (1 - fv) + red[beside(v), here(u)] * fv) * (1 - fu)
    expected += (red[here(v), beside(u)] * (1 - fv) + red[beside(v), beside(u)] * fv) * fu
    if filter == "nearest":
        expected = red[np.floor((v + 0.5) % 8).astype(int), np.floor((u + 0.5) % 8).astype(int)]
    for channel in (0, 1):
        np.testing.assert_allclose(seen[..., channel], expected, atol=1e-5)


#: A shader that shows the keyboard in red and green, and the sound in blue.
SIGNALS = """void mainImage(out vec4 c, in vec2 f) {
    ivec2 at = ivec2(f);
    c = vec4(texelFetch(iChannel0, at, 0).x, texture(iChannel0, (f + vec2(0.0, 1.0)) / iChannelResolution[0].xy).x,
             texelFetch(iChannel3, ivec2(at.x, 1), 0).x, iChannelResolution[3].x);
}"""


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("kind", ["text", "music", "musicstream", "mic"])
def test_keyboard_and_sound_are_inputs_that_are_black_at_first(tmp_path: Path, kind: str, backend: str) -> None:
    file = written(tmp_path, '#iChannel0 "keyboard"\n  # iChannel3  "audio" \n' + SIGNALS)
    if kind != "text":
        inputs = [{"channel": 0, "ctype": "keyboard", "id": "33", "sampler": {"filter": "nearest"}},
                  {"channel": 3, "ctype": kind, "id": "44"}]  # fmt: skip
        passes = [{"name": "Image", "type": "image", "code": SIGNALS, "inputs": inputs}]
        file = written(tmp_path, {"renderpass": passes})
    effect = pg.load_shader(file)
    assert (effect.images, effect.signals) == ((), ("keyboard", "audio"))
    keyboard, audio = np.zeros((3, 256, 1), np.uint8), np.zeros((2, 512, 1), np.uint8)
    keyboard[2, 3] = keyboard[1, 5] = 255  # rows are counted from the bottom: 3 is down, 5 was pressed
    audio[0, :, 0] = np.arange(512) % 256
    with pg.compile(effect(into=pg.target("o", "rgba32f")), backend=backend, size=(256, 1)) as program:
        assert program()["o"][0].tolist() == [[0.0, 0.0, 0.0, 512.0]] * 256
        seen = program(keyboard=keyboard, audio=audio)["o"][0]
        assert np.flatnonzero(seen[:, 0]).tolist() == [3] and seen[3, 0] == 1.0
        assert np.flatnonzero(seen[:, 1]).tolist() == [5] and seen[5, 1] == 1.0
        np.testing.assert_allclose(seen[:, 2], np.arange(256) / 255, atol=1e-6)
        assert not program()["o"][..., :3].any()


@pytest.mark.parametrize("word", ['"self"', "keyboard", ""])
def test_a_channel_that_is_declared_wrongly_is_told_with_its_line(tmp_path: Path, word: str) -> None:
    text = f'// #iChannel0 "x"\n/*\n#iChannel1 "y"\n*/\n#iChannel2 {word}\n{SIGNALS}'
    told = rf'life.json:5: #iChannel2 declares {word or "nothing"}, expected "keyboard" or "audio"; pictures are'
    with pytest.raises(pg.InputError, match=told):
        pg.load_shader(written(tmp_path, text))


def _first(key: str, value: object) -> dict[str, Any]:
    said = export()
    said["Shader"]["renderpass"][0][key] = value
    return said


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ('{"renderpass": [', "is no JSON"),
        ('{"renderpass": ' + "1" * 5000 + "}", "is no JSON: Exceeds the limit"),
        ('{"renderpass": ' + "[" * 1_000_000, "is no JSON: nested too deeply"),
        (_first("inputs", [{"channel": 1.0, "ctype": "buffer"}]), "an input's channel is 0 to 3, got 1.0"),
        (_first("inputs", [{"channel": True, "ctype": "buffer"}]), "an input's channel is 0 to 3, got True"),
        ({"renderpass": 3}, "renderpass must be a list of at most 8 passes, got 3"),
        ({"renderpass": []}, "has no pass of type image"),
        (_first("type", "cubemap"), "a 'cubemap' is not read here"),
        (_first("code", None), "pass 'Image' has no code"),
        (_first("inputs", [{"channel": 9, "ctype": "buffer"}]), "an input's channel is 0 to 3, got 9"),
        (_first("inputs", [{"channel": 1, "ctype": "buffer", "id": "77"}]), "reads a buffer that no pass writes"),
        (_first("inputs", [{"channel": 1, "ctype": "volume", "id": "77"}]), "is a volume, which is not read here"),
        (_first("code", "void mainImage(out vec4 c, in vec2 f) {\n  c = nothing;\n}"), r"life.json \(Image\):2: "),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, said: object, told: str) -> None:
    with pytest.raises(pg.PassgraphError, match=told):
        pg.load_shader(written(tmp_path, said))


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("void mainImage(out vec4 c, in vec2 f) { c = vec4(f, 0.0, 1.0); } // void main()", "Shadertoy"),
        (
            "/* void main() */ void mainImage(out vec4 c, in vec2 f) { c = vec4(f, 0.0, 1.0); }",
            "Shadertoy",
        ),
        ("// void mainImage(\nvoid main() { gl_FragColor = vec4(gl_FragCoord.xy, 0.0, 1.0); }", "GLSL"),
        (
            "void mainImage(out vec4 c, in vec2 f) { c = vec4(f, 0.0, 1.0); }\n"
            "void main() { mainImage(gl_FragColor, gl_FragCoord.xy); }",
            "GLSL",
        ),
    ],
)
def test_what_calls_its_own_mainimage_is_a_plain_shader(tmp_path: Path, text: str, kind: str) -> None:
    file = tmp_path / "own.glsl"
    file.write_text(text)
    effect = pg.load_shader(file)
    assert effect.kind == kind
    with pg.compile(effect(into=pg.target("out", "rgba32f")), size=(4, 3)) as program:
        seen = program()["out"]
    assert seen[::-1][..., :2].tolist() == [[[x + 0.5, y + 0.5] for x in range(4)] for y in range(3)]
