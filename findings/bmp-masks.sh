#!/usr/bin/env bash
# (1) Most would guess: a library that opens a 32-bit BMP reads its channels where the masks of the header say.
# (2) What is: OpenImageIO reads bytes as blue, green, red, alpha whatever the masks are. Red and blue swap in a file with
#     masks for RGBA, and the byte that BI_RGB calls unused becomes alpha: a screenshot with zeros there is invisible.
#     Pillow reads both by the header.
# (3) OpenImageIO 3.2.2.0 from PyPI (BmpInput::open in src/bmp.imageio/bmpinput.cpp uses the masks for 16 bits only).
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT; cd "$folder"
python3 -m venv venv
venv/bin/pip -q install openimageio==3.2.2.0 pillow==11.3.0 numpy==2.2.6
cat > show.py <<'PY'
import struct, sys
import numpy as np, OpenImageIO as oiio
from PIL import Image

def bmp(name, words, masks):
    """Four equal pixels: with masks (BITMAPV4HEADER), or without (BITMAPINFOHEADER, BI_RGB)."""
    rows = np.full((2, 2), words, "<u4").tobytes()
    size = 108 if masks else 40
    info = struct.pack("<IiiHHIIiiII", size, 2, 2, 1, 32, 3 if masks else 0, len(rows), 2835, 2835, 0, 0)
    info = (info + struct.pack(f"<{len(masks)}I", *masks)).ljust(size, b"\0")
    open(name, "wb").write(b"BM" + struct.pack("<IHHI", 14 + size + len(rows), 0, 0, 14 + size) + info + rows)

bmp("masks.bmp", 0xFF0000C8, (0xFF, 0xFF00, 0xFF0000, 0xFF000000))  # red 200, alpha 255
bmp("unused.bmp", 0x00C80000, ())                                   # red 200, the unused byte 0
found = {}
for name in ("masks.bmp", "unused.bmp"):
    pixel = oiio.ImageInput.open(name).read_image("uint8").reshape(2, 2, -1)[0, 0].tolist()
    found[name] = pixel
    print(name, "OpenImageIO:", pixel, "Pillow:", Image.open(name).convert("RGBA").getpixel((0, 0)))
sys.exit(found != {"masks.bmp": [0, 0, 200, 255], "unused.bmp": [200, 0, 0, 0]})
PY
venv/bin/python show.py
