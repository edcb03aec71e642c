"""A caller's wgpu device: textures are used in place, kept, and checked before anything runs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import passgraph as pg

wgpu = pytest.importorskip("wgpu")
pytestmark = pytest.mark.webgpu

WIDTH, HEIGHT = 37, 11
EVERY = "TEXTURE_BINDING | RENDER_ATTACHMENT | COPY_SRC | COPY_DST"
invert = pg.kernel(source="def invert(c: Image) -> vec4: return vec4(1.0 - c[0, 0].rgb, c[0, 0].a)")
PHOTO = np.random.default_rng(3).integers(0, 256, (HEIGHT, WIDTH, 4), np.uint8)


@pytest.fixture(scope="module")
def device() -> Any:
    from passgraph.backends.webgpu import devices

    return devices.choose(None).request_device_sync()


@pytest.fixture
def host(device: Any) -> Iterator[Any]:
    with pg.webgpu.Host(device) as made:
        yield made


def texture(device: Any, format: str = "rgba8unorm", usage: str = EVERY, **options: Any) -> Any:
    flags = 0
    for name in usage.split(" | "):
        flags |= wgpu.TextureUsage[name]
    made = device.create_texture(**{"size": (WIDTH, HEIGHT, 1), "format": format, "usage": flags, **options})
    if "COPY_DST" in usage and "8unorm" in format and options.get("sample_count", 1) == 1:
        layout = {"bytes_per_row": 4 * WIDTH}
        device.queue.write_texture({"texture": made}, PHOTO, layout, (WIDTH, HEIGHT, 1))
    return made


def content(device: Any, made: Any) -> Any:
    data = device.queue.read_texture({"texture": made}, {"bytes_per_row": 4 * WIDTH}, (WIDTH, HEIGHT, 1))
    return np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 4)


def inverted() -> Any:
    return np.concatenate([255 - PHOTO[..., :3], PHOTO[..., 3:]], axis=2)


def program_of(host: Any, format: str = "rgba8") -> Any:
    return pg.compile(invert(pg.Input("frame"), into=pg.target("out", format)), backend=host)


@pytest.mark.parametrize("name", ["rgba8unorm", "bgra8unorm"])
def test_textures_are_used_in_place_and_stay_the_host_s(host: Any, device: Any, name: str) -> None:
    source, room = texture(device, name), texture(device, name)
    with program_of(host) as program:
        for _ in range(3):
            program.run(frame=source, into={"out": room})
        assert "read in place" in program.explain() and "written in place" in program.explain()
    host.close()
    np.testing.assert_array_equal(content(device, room), inverted())
    np.testing.assert_array_equal(content(device, source), PHOTO)


def test_srgb_formats_are_copied_on_the_device_and_exact(host: Any, device: Any) -> None:
    source, room = texture(device, "rgba8unorm-srgb"), texture(device, "rgba8unorm-srgb")
    for srgb, format_ in ((False, "rgba8"), (True, "rgba8_srgb")):
        same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
        with pg.compile(same(pg.Input("frame"), into=pg.target("out", format_)), backend=host) as program:
            program.run(frame=host.texture(source, srgb=srgb), into={"out": host.texture(room, srgb=srgb)})
            assert "moved" in program.explain()
        np.testing.assert_array_equal(content(device, room), PHOTO)


def test_a_result_may_overwrite_its_input(host: Any, device: Any) -> None:
    here = texture(device)
    with program_of(host) as program:
        program.run(frame=here, into={"out": here})
    np.testing.assert_array_equal(content(device, here), inverted())


def test_runs_are_recorded_in_the_host_s_encoder(host: Any, device: Any) -> None:
    source, room, last = (texture(device) for _ in range(3))
    lit = pg.kernel(source="def lit(c: Image, gain: float) -> vec4: return c[0, 0] * gain")
    output = lit(pg.Input("frame"), pg.Value("gain", float), into=pg.target("out", "rgba8"))
    with pg.compile(output, backend=host) as program:
        encoder = device.create_command_encoder()
        with host.recording(encoder):
            program.run(frame=source, gain=0.0, into={"out": room})
            program.run(frame=source, gain=1.0, into={"out": last})
            with pytest.raises(pg.BackendError, match="inside of recording"):
                program(frame=source, gain=1.0)["out"]
        np.testing.assert_array_equal(content(device, room), PHOTO)
    host.close()
    device.queue.submit([encoder.finish()])
    assert not content(device, room).any()
    np.testing.assert_array_equal(content(device, last), PHOTO)


@pytest.mark.parametrize(("made", "into", "message"), [
    ({"usage": "RENDER_ATTACHMENT"}, {}, "lacks TEXTURE_BINDING"),
    ({}, {"usage": "TEXTURE_BINDING"}, "lacks RENDER_ATTACHMENT"),
    ({}, {"format": "r8unorm", "usage": "RENDER_ATTACHMENT"}, r"has 4 channel\(s\)"),
    ({}, {"format": "rgba8unorm-srgb"}, "only one is sRGB-encoded"),
    ({}, {"format": "depth32float", "usage": "RENDER_ATTACHMENT"}, "which no pass writes"),
    ({}, {"size": (WIDTH + 1, HEIGHT, 1), "usage": "RENDER_ATTACHMENT"}, "38"),
    ({"format": "rgba16uint", "usage": "TEXTURE_BINDING"}, {}, "cannot be read by kernels"),
    ({"sample_count": 4, "usage": "TEXTURE_BINDING | RENDER_ATTACHMENT"}, {}, r"4 sample\(s\)"),
    ({"size": (WIDTH, HEIGHT, 2), "usage": "TEXTURE_BINDING"}, {}, r"2 layer\(s\)"),
])  # fmt: skip
def test_textures_that_do_not_fit(host: Any, device: Any, made: Any, into: Any, message: str) -> None:
    with program_of(host) as program, pytest.raises(pg.PassgraphError, match=message):
        program.run(frame=texture(device, **made), into={"out": texture(device, **into)})


def test_other_devices_and_objects_are_named(host: Any) -> None:
    for given in (None, 3, "gpu"):
        with pytest.raises(pg.BackendError, match=r"takes a wgpu\.GPUDevice"):
            pg.webgpu.Host(given)
    with pytest.raises(pg.InputError, match="GPUTexture or a view"):
        host.texture(3)
    with pytest.raises(pg.BackendError, match="GPUCommandEncoder"), host.recording(3):
        pass
    from passgraph.backends.webgpu import devices

    second = devices.choose(None).request_device_sync()
    with pytest.raises(pg.InputError, match="of another device"):
        host.texture(texture(second))
    with pg.webgpu.Host(second) as foreign, program_of(host) as program:
        given = foreign.texture(texture(second))
        with pytest.raises(pg.InputError, match="another host"):
            program.run(frame=given)
