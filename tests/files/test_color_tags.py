"""A picture that was converted has the color tags of its own space; one that was not has its source's.

Tags are read by decoders that share no code with the writer: chunks of PNG by hand, OpenEXR's own library, Pillow.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image, ImageCms

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.errors import InputError
from passgraph.files import Pictures, Pipe, ToPictures, ToPipe
from passgraph.files.names import Pattern
from tests.files.made import video

av: Any = pytest.importorskip("av")
PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
#: xy of ACES AP0 and AP1 (SMPTE ST 2065-1, Academy S-2014-004).
AP0 = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
COPY = ("black-and-white",)
TO_P3 = ("color-transform", "--src", "sRGB - Texture", "--dst", "sRGB Encoded P3-D65 - Texture")
TO_ACESCG = ("color-transform", "--src", "sRGB - Texture", "--dst", "ACEScg")
TO_LOG = ("color-transform", "--src", "ACEScg", "--dst", "ACEScct")
TO_LOOK = ("color-transform", "--file", "look.cube")
TO_PQ = ("color-transform", "--src", "ACEScg", "--display", "Rec.2100-PQ - Display")


def chunks(path: Path) -> dict[str, bytes]:
    data, at, found = path.read_bytes(), 8, dict[str, bytes]()
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        found[data[at + 4 : at + 8].decode()] = data[at + 8 : at + 8 + size]
        at += 12 + size
    return found


def png_tags(path: Path) -> dict[str, Any]:
    found = chunks(path)
    return {
        **({"cICP": tuple(found["cICP"])} if "cICP" in found else {}),
        **({"gAMA": struct.unpack(">I", found["gAMA"])[0]} if "gAMA" in found else {}),
        **{name: True for name in ("iCCP", "sRGB", "cHRM") if name in found},
    }


def exr_tags(path: Path) -> dict[str, Any]:
    with OpenEXR.File(str(path)) as file:
        header = dict(file.header())  # closing the file empties it
    found = {name: header[name] for name in ("colorInteropID", "chromaticities") if name in header}
    if "chromaticities" in found:
        found["chromaticities"] = tuple(round(float(x), 5) for x in found["chromaticities"])
    return found


def tags(path: Path) -> dict[str, Any]:
    if path.suffix == ".png":
        return png_tags(path)
    if path.suffix == ".exr":
        return exr_tags(path)
    with Image.open(path) as image:
        return {"iCCP": True} if image.info.get("icc_profile") else {}


def png_source(path: Path, *, profile: bool = False, cicp: tuple[int, int] | None = None, gamma: int = 0) -> Path:
    """A PNG made by Pillow, with chunks put behind its header by hand."""
    pixels = Image.fromarray(np.full((4, 6, 3), 128, np.uint8))
    pixels.save(path, **({"icc_profile": PROFILE} if profile else {}))
    more = b""
    if cicp is not None:
        more += chunk(b"cICP", bytes((*cicp, 0, 1)))
    if gamma:
        more += chunk(b"gAMA", struct.pack(">I", gamma))
    data = path.read_bytes()
    path.write_bytes(data[:33] + more + data[33:])
    return path


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def exr_source(path: Path, **attributes: Any) -> Path:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    with OpenEXR.File(header, {"RGB": np.full((4, 6, 3), 0.25, np.float32)}) as file:
        file.write(str(path))
    return path


P3 = {"cICP": (12, 13, 0, 1)}
S_RGB = {"gAMA": 45455, "sRGB": True, "cHRM": True}
IN_AP1 = {"colorInteropID": "lin_ap1_scene", "chromaticities": AP1}
#: Source, its tags, the effect, the output, and the output's tags.
CASES: dict[str, tuple[str, dict[str, Any], tuple[str, ...], str, dict[str, Any]]] = {
    # Colors stay in their space.
    "profile kept": ("a.png", {"profile": True}, COPY, "b.png", {"iCCP": True}),
    "profile kept in JPEG": ("a.png", {"profile": True}, COPY, "b.jpg", {"iCCP": True}),
    "cICP kept": ("a.png", {"cicp": (12, 13)}, COPY, "b.png", P3),
    "cICP of PQ kept": ("a.png", {"cicp": (9, 16)}, COPY, "b.png", {"cICP": (9, 16, 0, 1)}),
    "cICP and profile kept": (
        "a.png", {"cicp": (12, 13), "profile": True}, COPY, "b.png", {"cICP": (12, 13, 0, 1), "iCCP": True},
    ),
    "linear gAMA kept": ("a.png", {"gamma": 100000}, COPY, "b.png", {"gAMA": 100000}),
    "no tags": ("a.png", {}, COPY, "b.png", S_RGB),
    "chromaticities kept": ("a.exr", {"chromaticities": AP0}, COPY, "b.exr", {"chromaticities": AP0}),
    "ID kept": ("a.exr", {"colorInteropID": "lin_p3d65_scene"}, COPY, "b.exr", {
        "colorInteropID": "lin_p3d65_scene",
        "chromaticities": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329),
    }),
    "unknown chromaticities kept": ("a.exr", {"chromaticities": (0.7, 0.3, 0.2, 0.7, 0.1, 0.1, 0.3, 0.3)}, COPY,
        "b.exr", {"chromaticities": (0.7, 0.3, 0.2, 0.7, 0.1, 0.1, 0.3, 0.3)}),
    "no tags of EXR": ("a.exr", {}, COPY, "b.exr", {}),
    # Colors are converted.
    "profile to P3": ("a.png", {"profile": True}, TO_P3, "b.png", P3),
    "profile to P3 in JPEG": ("a.png", {"profile": True}, TO_P3, "b.jpg", {}),
    "profile to light": ("a.png", {"profile": True}, TO_ACESCG, "b.exr", IN_AP1),
    "chromaticities to log": (
        "a.exr", {"chromaticities": AP0}, TO_LOG, "b.exr", {"colorInteropID": "ocio:acescct_ap1_scene"}),
    "chromaticities through a LUT": ("a.exr", {"chromaticities": AP0}, TO_LOOK, "b.exr", {}),
    "profile through a LUT": ("a.png", {"profile": True}, TO_LOOK, "b.png", {}),
    "chromaticities to PQ": ("a.exr", {"chromaticities": AP0}, TO_PQ, "b.png", {"cICP": (9, 16, 0, 1)}),
    "ID to PQ": (
        "a.exr", {"colorInteropID": "lin_ap0_scene"}, TO_PQ, "b.exr", {"colorInteropID": "pq_rec2020_display"}),
    "back": ("a.png", {"cicp": (12, 13)}, (*TO_P3, "--direction", "inverse"), "b.png", S_RGB),
    "default display": ("a.exr", {"chromaticities": AP0}, ("color-transform",), "b.png", S_RGB),
    "the same space": ("a.png", {"profile": True}, (
        "color-transform", "--src", "srgb_texture", "--dst", "sRGB Encoded Rec.709 (sRGB)"), "b.png", {"iCCP": True}),
    "around an effect": ("a.png", {"profile": True}, (
        "gaussian-blur", "--from-space", "sRGB - Texture", "--to-space", "ACEScg"), "b.exr", IN_AP1),
    "around an effect and back": ("a.png", {"profile": True}, (
        "gaussian-blur", "--from-space", "sRGB - Texture"), "b.png", {"iCCP": True}),
    "tone map": ("a.exr", {"colorInteropID": "lin_rec709_scene"}, ("tone-map",), "b.png", S_RGB),
    "tone map of a profile": ("a.png", {"profile": True}, ("tone-map",), "b.png", S_RGB),
    "tone map to light": ("a.exr", {"chromaticities": AP0}, ("tone-map", "--no-encode"), "b.exr", {
        "colorInteropID": "lin_rec709_scene",
        "chromaticities": (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)}),
    # Codes are decoded to light, or light is encoded: the gamut stays.
    "light of sRGB": ("a.png", {}, ("cas",), "b.exr", {
        "colorInteropID": "lin_rec709_scene",
        "chromaticities": (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)}),
    "light of P3": ("a.png", {"cicp": (12, 13)}, ("cas",), "b.exr", {
        "colorInteropID": "lin_p3d65_scene",
        "chromaticities": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329)}),
    "light of a profile": ("a.png", {"profile": True}, ("cas",), "b.exr", {}),
    "codes of light": ("a.exr", {"colorInteropID": "lin_p3d65_scene"}, ("cas",), "b.png", P3),
    "codes of AP1": ("a.exr", {"colorInteropID": "lin_ap1_scene"}, ("cas",), "b.png", {}),
    "decoded and encoded again": ("a.png", {"profile": True}, ("cas",), "b.png", {"iCCP": True}),
}  # fmt: skip


@pytest.fixture(autouse=True)
def look(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A LUT, about whose colors nothing is known, in the working folder."""
    corners = [f"{r} {g} {b}" for b in (0, 1) for g in (0, 1) for r in (0, 0.5)]
    (tmp_path / "look.cube").write_text("LUT_3D_SIZE 2\n" + "\n".join(corners))
    monkeypatch.chdir(tmp_path)


def source(path: Path, given: dict[str, Any]) -> Path:
    return exr_source(path, **given) if path.suffix == ".exr" else png_source(path, **given)


@pytest.mark.parametrize("case", CASES)
def test_a_result_has_the_tags_of_its_own_space(tmp_path: Path, case: str) -> None:
    name, given, effect, output, expected = CASES[case]
    made = source(tmp_path / name, given)
    assert run(["apply", effect[0], str(made), "-o", str(tmp_path / output), *effect[1:]]) == 0
    assert tags(tmp_path / output) == expected


def test_each_frame_of_a_sequence_too(tmp_path: Path) -> None:
    for number in (1, 2):
        png_source(tmp_path / f"a.{number}.png", profile=number == 1)
    words = [str(tmp_path / "a.%d.png"), "-o", str(tmp_path / "b.%d.png")]
    assert run(["apply", TO_P3[0], *words, *TO_P3[1:]]) == 0
    assert [tags(tmp_path / f"b.{number}.png") for number in (1, 2)] == [P3, P3]


@pytest.mark.parametrize(("effect", "output", "words"), [
    (TO_PQ, "b.jpg", r"b\.jpg: JPEG files state no color space Rec\.2100-PQ - Display; readers take them as sRGB; "
     r"save as \.png or \.exr"),
    (TO_ACESCG, "b.png", r"b\.png: PNG files state no color space ACEScg; .* sRGB; save as \.exr"),
    (TO_LOOK, "b.exr", r"b\.exr: OpenEXR files state no color space of LUT look\.cube; .* as linear Rec\. 709\n"),
    (TO_PQ, "b.png", ""), (TO_ACESCG, "b.exr", ""), (("tone-map",), "b.jpg", ""), (TO_LOG, "b.npy", ""),
])  # fmt: skip
@pytest.mark.parametrize("many", [False, True])
def test_tags_that_go_are_told(
    tmp_path: Path, effect: tuple[str, ...], output: str, words: str, many: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["a.1.exr", "a.2.exr"] if many else ["a.exr"]
    made = [str(exr_source(tmp_path / name)) for name in names]
    output = output.replace("b.", "b.%d.") if many else output
    assert run(["apply", effect[0], *made, "-o", str(tmp_path / output), *effect[1:]]) == 0
    told = capsys.readouterr().err
    assert re.search(words.replace(r"b\.", r"b\.1\.") if many else words, told)
    assert ("state no color space" in told) == bool(words)


def test_the_color_space_of_a_saved_picture_is_named(tmp_path: Path) -> None:
    picture, given = np.full((4, 6, 3), 0.5, np.float32), png_source(tmp_path / "a.png", profile=True)
    pg.save(tmp_path / "b.png", picture, like=given, color="srgb_p3d65_scene")
    pg.save(tmp_path / "b.exr", picture, like=given, color="lin_ap1_scene")
    assert (tags(tmp_path / "b.png"), tags(tmp_path / "b.exr")) == (P3, IN_AP1)
    pg.save(tmp_path / "c.png", picture, like=given, color="")
    assert tags(tmp_path / "c.png") == {}
    with pytest.warns(UserWarning, match=r"d\.jpg: JPEG files state no color space lin_ap1_scene; .* save as \.exr"):
        pg.save(tmp_path / "d.jpg", picture, like=given, color="lin_ap1_scene")
    assert tags(tmp_path / "d.jpg") == {}
    with pytest.raises(InputError, match=r"e\.png: color must be a string, got 3"):
        pg.save(tmp_path / "e.png", picture, color=3)  # type: ignore[arg-type]


# Videos


def video_tags(path: Path) -> tuple[int, int, int]:
    """Primaries, transfer and matrix of H.273 that a decoder finds."""
    with av.open(str(path)) as container:
        frame = next(container.decode(video=0))
        return int(frame.color_primaries), int(frame.color_trc), int(frame.colorspace)


#: BT.2020 with PQ, and its source: tags of one are those of the other if colors stay in their space.
PQ = {"colorspace": 9, "color_primaries": 9, "color_trc": 16}
BT709 = {"colorspace": 1, "color_primaries": 1, "color_trc": 1}
VIDEOS: dict[str, tuple[dict[str, int], tuple[str, ...], tuple[int, int, int]]] = {
    "kept": (PQ, COPY, (9, 16, 9)),
    "BT.709 kept": (BT709, COPY, (1, 1, 1)),
    "to sRGB": (PQ, ("tone-map",), (1, 13, 1)),
    "to PQ": (BT709, ("color-transform", "--display", "Rec.2100-PQ - Display"), (9, 16, 9)),
    "to P3": (BT709, TO_P3, (12, 13, 1)),
    "to a space without codes": (BT709, TO_LOG, (2, 2, 2)),
    "light and back": (BT709, ("cas",), (1, 1, 1)),
}


@pytest.mark.parametrize("case", VIDEOS)
def test_a_video_has_the_tags_of_its_own_space(tmp_path: Path, case: str, capsys: pytest.CaptureFixture[str]) -> None:
    given, effect, expected = VIDEOS[case]
    made = video(tmp_path / "a.mkv", 2, **given)
    assert video_tags(made) == (given["color_primaries"], given["color_trc"], given["colorspace"])
    assert run(["apply", effect[0], str(made), "-o", "b.mkv", *effect[1:]]) == 0
    assert video_tags(tmp_path / "b.mkv") == expected
    told = "b.mkv: videos state no color space ACEScct; its color tags are left out"
    assert (told in capsys.readouterr().err) == (effect == TO_LOG)


def test_pictures_and_videos_tag_each_other(tmp_path: Path) -> None:
    """HDR frames as PNG and OpenEXR are not taken as sRGB or light, nor a video of P3 pictures as BT.709."""
    made = video(tmp_path / "a.mkv", 2, **PQ)
    for name in ("b.%d.png", "b.%d.exr"):
        assert run(["apply", *COPY, str(made), "-o", name]) == 0
    assert tags(tmp_path / "b.1.png") == {"cICP": (9, 16, 0, 1)}
    assert tags(tmp_path / "b.1.exr") == {"colorInteropID": "pq_rec2020_display"}
    assert run(["apply", "cas", str(made), "-o", "e.%d.exr"]) == 0  # decoded by the curve of sRGB
    assert tags(tmp_path / "e.1.exr") == {}
    for number in (1, 2):
        Image.new("RGB", (64, 48)).save(tmp_path / "c.png")
        data = (tmp_path / "c.png").read_bytes()
        (tmp_path / f"c.{number}.png").write_bytes(data[:33] + chunk(b"cICP", bytes((12, 13, 0, 1))) + data[33:])
    assert run(["apply", *COPY, "c.%d.png", "-o", "c.mkv"]) == 0
    assert video_tags(tmp_path / "c.mkv")[:2] == (12, 13)
    assert run(["apply", *COPY, str(video(tmp_path / "d.mkv", 2, **BT709)), "-o", "d.%d.png"]) == 0
    assert tags(tmp_path / "d.1.png") == S_RGB


# The table of docs/frames.md


def table() -> list[list[str]]:
    """Rows of the section "What is kept"."""
    text = (Path(__file__).parents[2] / "docs/frames.md").read_text(encoding="utf-8")
    section = text.split("### What is kept")[1].split("\n## ")[0]
    return [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")][1:]


def oiio_value(path: Path, name: str) -> Any:
    import OpenImageIO

    image = OpenImageIO.ImageInput.open(str(path))
    value = image.spec().getattribute(name)
    image.close()
    return None if value is None else tuple(np.ravel(value).tolist())


def pillow_source(path: Path) -> Path:
    """A picture with a profile, EXIF and resolution."""
    exif = Image.Exif()
    exif[0x010F] = "Camera"
    pixels = Image.new("RGB", (6, 4), (90, 120, 200))
    if path.suffix == ".apng":
        frames = [pixels, Image.new("RGB", (6, 4), (9, 9, 9))]
        frames[0].save(path, "PNG", save_all=True, append_images=frames[1:], duration=100, icc_profile=PROFILE)
    else:
        pixels.save(path, icc_profile=PROFILE, exif=exif, dpi=(150, 150))
    return path


def profile_of(path: Path) -> Any:
    with Image.open(path) as image:
        return image.info.get("icc_profile")


def pillow_value(path: Path, word: str) -> Any:
    with Image.open(path) as image:
        return image.getexif().get(0x010F) if word == "EXIF" else tuple(round(x) for x in image.info.get("dpi", ()))


def video_source(path: Path) -> Path:
    from tests.files.test_video_kept import HDR, write

    light = "master-display=G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,1):max-cll=1000,400"
    options = {"x265-params": f"log-level=none:{light}"}
    return write(path, "libx265", "yuv420p10le", (500, 512, 512), options, **HDR)


def timed_source(path: Path) -> Path:
    if path.suffix == ".exr":
        import OpenImageIO

        spec = OpenImageIO.ImageSpec(6, 4, 3, "half")
        spec.attribute("smpte:TimeCode", OpenImageIO.TypeDesc("timecode"), (0x01020304, 0))
        image = OpenImageIO.ImageOutput.create("a.exr")
        image.open(str(path), spec)
        image.write_image(np.zeros((4, 6, 3), np.float16))
        image.close()
        return path
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        container.metadata["timecode"] = "01:02:03:04"
        container.mux(stream.encode(av.VideoFrame(64, 48, "yuv420p")))
        container.mux(stream.encode())
    return path


def time_code(path: Path) -> Any:
    if path.suffix == ".exr":
        return oiio_value(path, "smpte:TimeCode")
    with av.open(str(path)) as container:
        return container.streams.video[0].metadata.get("timecode")


def hdr_numbers(path: Path) -> Any:
    from tests.files.test_video_kept import hdr_of

    return tuple(hdr_of(path)) or None


SUFFIXES = {
    "PNG": ".png", "JPEG": ".jpg", "TIFF": ".tif", "WebP": ".webp", "APNG": ".apng",
    "OpenEXR": ".exr", "MP4": ".mp4", "MKV": ".mkv", "MOV": ".mov",
}  # fmt: skip
#: What a file says → how to make such a file, how to read it, and its value after a conversion to PQ.
TAGS: dict[str, tuple[Any, Any, Any]] = {
    "ICC profile": (pillow_source, profile_of, None),
    "cICP": (lambda path: png_source(path, cicp=(12, 13)), lambda path: png_tags(path).get("cICP"), (9, 16, 0, 1)),
    "gAMA": (lambda path: png_source(path, gamma=100000), lambda path: png_tags(path).get("gAMA"), None),
    "`colorInteropID`": (
        lambda path: exr_source(path, colorInteropID="lin_ap0_scene"),
        lambda path: exr_tags(path).get("colorInteropID"), "pq_rec2020_display",
    ),
    "`chromaticities`": (
        lambda path: exr_source(path, chromaticities=AP0), lambda path: exr_tags(path).get("chromaticities"), None,
    ),
    "primaries, transfer and matrix": (video_source, video_tags, (12, 13, 1)),
    "mastering display and light levels": (video_source, hdr_numbers, None),
    "resolution": (pillow_source, lambda path: pillow_value(path, "resolution"), None),
    "EXIF": (pillow_source, lambda path: pillow_value(path, "EXIF"), None),
    "time code": (timed_source, time_code, None),
}  # fmt: skip


@pytest.mark.parametrize("row", table(), ids=lambda row: row[0])
def test_the_documented_tags_are_kept_or_of_the_result(tmp_path: Path, row: list[str]) -> None:
    make, read, of_the_result = TAGS[row[0]]
    for name in row[1].split(", "):
        suffix = SUFFIXES[name]
        made = make(tmp_path / f"a{suffix}")
        own = read(made)
        assert own, name
        to_p3 = row[0].startswith("primaries")
        for effect, word in ((COPY, row[2]), (TO_P3 if to_p3 else TO_PQ, row[3])):
            path = tmp_path / f"{effect[0]}{suffix}"
            assert run(["apply", effect[0], str(made), "-o", str(path), *effect[1:]]) == 0
            found = read(path)
            expected = {"kept": own, "left out": None, "that of the result": of_the_result}[word]
            assert (found or None) == expected, (name, word)


def test_the_table_has_every_tag() -> None:
    assert [row[0] for row in table()] == list(TAGS)


def test_what_a_source_states_and_its_copy_cannot_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = png_source(tmp_path / "a.png", cicp=(12, 13))
    clip = video(tmp_path / "a.mkv", 2, **PQ)
    for given, output, words in (
        (source, "b.jpg", "b.jpg: JPEG files state no color space srgb_p3d65_scene; readers take them as sRGB"),
        (clip, "c.%d.jpg", "c.1.jpg: JPEG files state no color space pq_rec2020_display; readers take them as sRGB"),
        (clip, "d.apng", "d.apng: animations state no color space pq_rec2020_display; readers take them as sRGB"),
        (source, "e.png", ""),
        (clip, "f.%d.png", ""),
    ):
        assert run(["apply", *COPY, str(given), "-o", output]) == 0
        told = capsys.readouterr().err
        assert (words in told) if words else ("state no" not in told)


def test_pictures_of_a_stream_keep_their_tags(tmp_path: Path) -> None:
    """Read from a stream, written into one, or both; a converted one has the tags of its own space."""
    copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
    sources = [png_source(tmp_path / "a.png", profile=True), png_source(tmp_path / "b.png", cicp=(12, 13))]
    data = b"".join(path.read_bytes() for path in sources)
    own = [{"iCCP": True}, P3]

    def streamed(source: Any, color: str | None = None) -> list[dict[str, Any]]:
        out = io.BytesIO()
        with pg.compile(copy(pg.Input("frame"))) as program:
            assert pg.frames(program, source, ToPipe(out, color=color)).whole
        found = []
        for number, part in enumerate(out.getvalue().split(b"\x89PNG\r\n\x1a\n")[1:]):
            (tmp_path / f"out{number}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + part)
            found.append(tags(tmp_path / f"out{number}.png"))
        return found

    assert streamed(Pipe(io.BytesIO(data))) == own
    assert streamed(Pictures(sources)) == own
    assert streamed(Pipe(io.BytesIO(data)), "srgb_p3d65_scene") == [P3, P3]
    with pg.compile(copy(pg.Input("frame"))) as program:
        assert pg.frames(program, Pipe(io.BytesIO(data)), ToPictures(Pattern("c.%d.png"))).whole
    assert [tags(tmp_path / f"c.{number}.png") for number in (1, 2)] == own


def test_an_effect_of_a_user_says_its_space(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import passgraph as pg\n"
        "from passgraph.color_tags import ColorSpace\n"
        "from passgraph.effects import effect\n"
        "def space(wide: bool = True, **_):\n"
        "    return ColorSpace('Display P3', 'srgb_p3d65_scene') if wide else None\n"
        "@pg.kernel\n"
        "def same(color: pg.Image) -> pg.vec4:\n"
        "    return color[0, 0]\n"
        "@effect('mine', result_space=space)\n"
        "def mine(frame: pg.Target, wide: bool = True) -> pg.Target:\n"
        "    return same(frame)\n"
    )
    source = png_source(tmp_path / "a.png", profile=True)
    for options, expected in (([], P3), (["--no-wide"], {"iCCP": True})):
        assert run(["apply", "mine.py", str(source), "-o", "b.png", *options]) == 0
        assert tags(tmp_path / "b.png") == expected


def test_saving_like_a_file_takes_its_tags_as_far_as_they_hold(tmp_path: Path) -> None:
    """Of pixels as stored; light that is encoded has the file's gamut; of floats that were codes nothing is known."""
    picture = np.full((4, 6, 3), 0.5, np.float32)
    light = exr_source(tmp_path / "a.exr", colorInteropID="lin_p3d65_scene")
    codes = png_source(tmp_path / "a.png", cicp=(12, 13))
    pg.save(tmp_path / "b.png", picture, like=light, linear=True)
    pg.save(tmp_path / "c.png", picture, like=codes, linear=True)
    assert (tags(tmp_path / "b.png"), tags(tmp_path / "c.png")) == (P3, P3)
    pg.save(tmp_path / "d.png", picture, like=exr_source(tmp_path / "e.exr", chromaticities=AP0), linear=True)
    assert tags(tmp_path / "d.png") == {}
    pg.save(tmp_path / "f.exr", picture, like=codes)
    assert tags(tmp_path / "f.exr") == {}


def test_tiles_have_the_tags_of_their_own_space(tmp_path: Path) -> None:
    copy = pg.kernel(source="def copy(color: Image) -> vec3: return color[0, 0].rgb")
    graph = copy(pg.Input("frame", "rgb8"), into=pg.target("o", "rgb8"))
    Image.new("RGB", (6, 4)).save(tmp_path / "a.tif", icc_profile=PROFILE)
    for color, profile, space in ((None, True, {}), ("lin_ap1_scene", False, IN_AP1), ("", False, {})):
        for name in ("b.tif", "b.exr"):
            pg.tiled(graph, tmp_path / "a.tif", tmp_path / name, progress=False, color=color)
        assert bool(tags(tmp_path / "b.tif")) == profile
        assert tags(tmp_path / "b.exr") == space
    with pytest.raises(InputError, match="tiled: color must be a string, got 3"):
        pg.tiled(graph, tmp_path / "a.tif", tmp_path / "c.tif", progress=False, color=3)  # type: ignore[arg-type]
