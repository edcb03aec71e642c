#!/usr/bin/env bash
# Guess: what ImageSpec.attribute(name, type, value) is given can be read back, or an error is raised; so attributes of
#   a file can be copied with their own types.
# Is: from Python the value is dropped without an error for the types int8, int16, uint16, int64, uint64, half and
#   double, also as arrays. EXIF has mostly uint16: ISO speed, flash, metering mode, white balance. A copy of all
#   attributes of a JPEG keeps none of them. "int" and "float" hold the same numbers.
# OpenImageIO 3.2.2.0 (PyPI): attribute_typed in src/python/py_oiio.h knows int, uint, uint8, float and string, and
#   ImageSpec.attribute ignores that it returns false.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet OpenImageIO==3.2.2.0 Pillow==12.3.0 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PY'
import OpenImageIO as oiio
from PIL import ExifTags, Image

spec = oiio.ImageSpec(1, 1, 3, "uint8")
dropped = []
for kind in ("int8", "int16", "uint16", "int64", "uint64", "half", "double", "uint8", "int", "uint", "float"):
    spec.attribute("a", kind, 1)
    if spec.getattribute("a") is None:
        dropped.append(kind)
    spec.erase_attribute("a")
print("set and not there:", ", ".join(dropped))

exif = Image.Exif()
exif.get_ifd(ExifTags.IFD.Exif).update({ExifTags.Base.Flash: 16, ExifTags.Base.FNumber: 2.8})
Image.new("RGB", (8, 8)).save("photo.jpg", exif=exif)
photo = oiio.ImageInput.open("photo.jpg").spec()
for as_stored in (True, False):
    copy = oiio.ImageSpec(8, 8, 3, "uint8")
    for entry in photo.extra_attribs:
        kind = str(entry.type)
        copy.attribute(entry.name, "int" if kind == "uint16" and not as_stored else kind, entry.value)
    print("types as stored:" if as_stored else "uint16 as int:", "Flash", copy.getattribute("Exif:Flash"))
    flash = copy.getattribute("Exif:Flash")
    assert flash == (None if as_stored else 16), flash
assert dropped == ["int8", "int16", "uint16", "int64", "uint64", "half", "double"], dropped
PY
