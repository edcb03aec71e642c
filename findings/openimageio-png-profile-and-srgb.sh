#!/usr/bin/env bash
# Guess: a PNG that OpenImageIO writes with an ICC profile, or with a CICP attribute, states its colors by that alone.
# Is: it also has the chunks sRGB, gAMA and cHRM of sRGB, which contradict a profile or cICP of another gamut. (PNG, third
#     edition, 11.3.2.5: sRGB should not be beside iCCP.) With the attribute oiio:ColorSpace set to a name that it does
#     not know, such as "unknown", the chunks stay away.
# Seen with: OpenImageIO 3.2.2.0, Pillow 12.0.0, numpy 2.3.5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check openimageio==3.2.2.0 pillow==12.0.0 numpy==2.3.5
venv/bin/python - <<'PYTHON'
import struct
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import ImageCms

profile = np.frombuffer(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes(), np.uint8)
ICC = ("ICCProfile", f"uint8[{profile.size}]", profile)
DISPLAY_P3 = ("CICP", "int[4]", (12, 13, 0, 1))
UNKNOWN = ("oiio:ColorSpace", "string", "unknown")


def color_chunks(*attributes):
    spec = oiio.ImageSpec(4, 4, 3, "uint8")
    for attribute in attributes:
        spec.attribute(*attribute)
    image = oiio.ImageOutput.create("a.png")
    image.open("a.png", spec)
    image.write_image(np.zeros((4, 4, 3), np.uint8))
    image.close()
    data, at, found = Path("a.png").read_bytes(), 8, []
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        found.append(data[at + 4 : at + 8].decode())
        at += 12 + size
    return sorted({"cICP", "iCCP", "sRGB", "gAMA", "cHRM"} & set(found))


found = {
    "profile": color_chunks(ICC),
    "cICP": color_chunks(DISPLAY_P3),
    "profile, unknown": color_chunks(ICC, UNKNOWN),
    "cICP, unknown": color_chunks(DISPLAY_P3, UNKNOWN),
}
for name, chunks in found.items():
    print(f"{name}: {', '.join(chunks)}")
assert found == {
    "profile": ["cHRM", "gAMA", "iCCP", "sRGB"],
    "cICP": ["cHRM", "cICP", "gAMA", "sRGB"],
    "profile, unknown": ["iCCP"],
    "cICP, unknown": ["cICP"],
}, "changed"
PYTHON
