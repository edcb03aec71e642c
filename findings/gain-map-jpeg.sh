#!/usr/bin/env bash
# (1) Most would guess: OpenImageIO opens a JPEG as 8-bit RGB, whatever stands behind the picture in the file.
# (2) What is: with a gain map (Ultra HDR, as Android phones write it) it returns four channels of half floats, linear
#     light above 1, and calls them sRGB. No open hint or attribute turns that off. Without the bytes behind the first
#     JPEG stream the same file is 8-bit again. Pillow and OpenCV read the base picture.
# (3) OpenImageIO 3.2.2.0 from PyPI (libultrahdr built in; JpgInput::open and read_uhdr in src/jpeg.imageio/jpeginput.cpp).
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT; cd "$folder"
python3 -m venv venv
venv/bin/pip -q install openimageio==3.2.2.0 pillow==11.3.0 numpy==2.2.6
cat > show.py <<'PY'
import io, struct, sys
import numpy as np, OpenImageIO as oiio
from PIL import Image

def jpeg(pixels, **properties):
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=95, subsampling=0)
    text = ('<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
            '<rdf:Description xmlns:hdrgm="http://ns.adobe.com/hdr-gain-map/1.0/" hdrgm:Version="1.0"'
            + "".join(f' hdrgm:{name}="{value}"' for name, value in properties.items()) + "/></rdf:RDF></x:xmpmeta>")
    body = b"http://ns.adobe.com/xap/1.0/\0" + text.encode()
    data = stream.getvalue()
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[2:]

base = jpeg(np.full((64, 64, 3), 118, np.uint8))
gains = jpeg(np.full((64, 64), 255, np.uint8), GainMapMax=2, HDRCapacityMax=2)
open("photo.jpg", "wb").write(base + gains)
open("base.jpg", "wb").write(base)

def read(name):
    image = oiio.ImageInput.open(name)
    spec = image.spec()
    return str(spec.format), spec.nchannels, spec.getattribute("oiio:ColorSpace"), image.read_image("float").reshape(64, 64, -1)[0, 0, 0]

for name in ("photo.jpg", "base.jpg"):
    print(name, "OpenImageIO:", *read(name), "Pillow:", Image.open(name).getpixel((0, 0)))
kind, channels, space, value = read("photo.jpg")
is_as_described = kind == "half" and channels == 4 and space.startswith("srgb") and 0.6 < value < 0.8
sys.exit(not (is_as_described and read("base.jpg")[0] == "uint8" and Image.open("photo.jpg").getpixel((0, 0)) == (118,) * 3))
PY
venv/bin/python show.py
