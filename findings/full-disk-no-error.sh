#!/usr/bin/env bash
# Guess: a picture or array that is written without an error is on the disk.
# Is: numpy.save(path, array) and OpenImageIO's write_image and close report success although the last block of the file
#   could not be written. Both write through C's buffered streams and ignore the result of the last flush: NumPy in
#   npy_PyFile_DupClose2 (numpy/_core/include/numpy/npy_3kcompat.h), OpenImageIO in IOFile::close
#   (src/libutil/filesystem.cpp). Python's own files raise OSError. np.save into a BytesIO, and a checked copy, is safe.
# The limit of a file's size stands for a full disk here; a full tmpfs does the same.
# numpy 2.4.6, OpenImageIO 3.2.2.0 (PyPI), Linux.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet OpenImageIO==3.2.2.0 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PY'
import io
import os
import resource

import numpy as np
import OpenImageIO as oiio

pixels = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)


def numpy_save(path):
    np.save(path, pixels)


def python_file(path):
    stream = io.BytesIO()
    np.save(stream, pixels)
    with open(path, "wb") as file:
        file.write(stream.getvalue())


def openimageio(path):
    output = oiio.ImageOutput.create(path)
    assert output.open(path, oiio.ImageSpec(80, 60, 3, "uint8"))
    assert output.write_image(pixels)
    assert output.close()
    assert not output.geterror()


found = {}
for name, write in {"a.npy": numpy_save, "b.npy": python_file, "a.ppm": openimageio, "a.png": openimageio}.items():
    write(name)
    whole = os.path.getsize(name)
    resource.setrlimit(resource.RLIMIT_FSIZE, (whole - 100, resource.RLIM_INFINITY))
    try:
        write(name)
        found[name] = "no error"
    except OSError as error:
        found[name] = type(error).__name__
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    print(f"{name}: {found[name]}, {os.path.getsize(name)} of {whole} bytes")
    assert os.path.getsize(name) < whole
assert found == {"a.npy": "no error", "b.npy": "OSError", "a.ppm": "no error", "a.png": "no error"}, found
PY
