"""Checks of a model file before anything is allocated, and a reader that stays in its folder.

Model files come from strangers: counts are held against the size of the file, and the names of textures and
material files may not lead out of the folder of the model.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from io import BytesIO
from os import PathLike
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.scene.material import check_texels

SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
PICTURE_SUFFIXES = (".bmp", ".jpeg", ".jpg", ".png", ".tga", ".tif", ".tiff", ".webp")
# A model of 1 GiB has some 30 million triangles; loading needs several times its size.
MAX_FILE_BYTES = 1 << 30


def checked_path(path: str | PathLike[str], max_bytes: int = MAX_FILE_BYTES) -> Path:
    """The path of a readable model file of a known kind and sane size, or an InputError."""
    file = arguments.path(path, "the model to load")
    if file.is_dir():
        raise InputError(f"{file}: a folder; expected a model file ({', '.join(SUFFIXES)})")
    if not file.exists():
        raise InputError(f"{file}: no such file")
    if not file.is_file():
        raise InputError(f"{file}: not a regular file")
    if file.suffix.lower() not in SUFFIXES:
        got = file.suffix or "no suffix"
        raise InputError(f"{file}: unknown kind of model ({got}); expected one of {', '.join(SUFFIXES)}")
    size = file.stat().st_size
    if size == 0:
        raise InputError(f"{file}: the file is empty (0 bytes)")
    if size > max_bytes:
        raise InputError(f"{file}: {size} bytes are more than the limit of {max_bytes}; simplify the model")
    _check_counts(file, size)
    return file


def _check_counts(file: Path, size: int) -> None:
    """Refuse headers that announce more elements than the file has bytes, before a reader allocates them."""
    if file.suffix.lower() not in (".ply", ".off"):
        return
    with file.open("rb") as stream:
        head = stream.read(1 << 16)
    if file.suffix.lower() == ".ply":
        counts = [int(n) for n in re.findall(rb"^element\s+\S+\s+(\d+)", head.split(b"end_header")[0], re.M)]
    else:
        lines = [line.split(b"#")[0].split() for line in head.splitlines()]
        words = [word for line in lines for word in line]
        counts = [int(word) for word in words[1:4] if word.isdigit()][:2]
    if counts and max(counts) > size:
        raise InputError(
            f"{file}: the header announces {max(counts)} elements, but the file has only {size} bytes; "
            "it is truncated or corrupt"
        )


class FolderReader:
    """Reads files named in a model, only below the model's folder; trimesh calls it as its resolver.

    Attributes
    ----------
    missing : names that were asked for and not found
    refused : sentences about names that must not be read
    bombs : sentences about pictures beyond the limit
    """

    def __init__(self, model: Path) -> None:
        self.folder = model.resolve().parent
        self.file_name = model.name
        self.missing: list[str] = []
        self.refused: list[str] = []
        self.bombs: list[str] = []

    def find(self, name: str) -> Path | None:
        """The file a model names, or None (noted in ``missing`` or ``refused``)."""
        clean = unquote(plain_name(name).replace("\\", "/"))
        outside = clean.startswith(("/", "~")) or bool(PureWindowsPath(clean).drive) or "\0" in clean
        # resolve follows links, so that neither '..' nor a link leads out
        path = self.folder if outside else (self.folder / clean).resolve()
        if outside or not path.is_relative_to(self.folder):
            self._note(self.refused, f"{name!r} leads out of the folder of the model")
            return None
        if not path.is_file():
            self._note(self.missing, clean)
            return None
        if path.stat().st_size > MAX_FILE_BYTES:
            self._note(self.refused, f"{name!r} has more than {MAX_FILE_BYTES} bytes")
            return None
        return path

    def get(self, name: str) -> bytes:
        """The bytes of a file the model names; raises FileNotFoundError, as trimesh expects."""
        path = self.find(name)
        if path is None:
            raise FileNotFoundError(name)
        data = path.read_bytes()
        if path.suffix.lower() in PICTURE_SUFFIXES:
            try:
                check_picture(data, str(path))
            except InputError as error:
                # trimesh swallows every exception of a picture; the loader reads the note
                self._note(self.bombs, str(error))
                raise
        return as_utf8(data) if path.suffix.lower() == ".mtl" else data

    __getitem__ = get

    def keys(self) -> Iterator[str]:
        """Names below the folder are not listed: nothing here needs them."""
        return iter(())

    def __contains__(self, name: str) -> bool:
        return self.find(name) is not None

    @staticmethod
    def _note(notes: list[str], text: str) -> None:
        if text not in notes:
            notes.append(text)


def as_utf8(data: bytes) -> bytes:
    """Text in UTF-8, UTF-16 with a byte order mark, or else Latin-1, as UTF-8: model files name no encoding.

    >>> as_utf8("v 1".encode("utf-16"))
    b'v 1'
    """
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig")):
        if data.startswith(mark):
            return data.decode(encoding, errors="replace").encode()
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data


def plain_name(name: str) -> str:
    """The file name of an MTL texture line without its options.

    >>> plain_name("-s 1 1 1 -bm 0.2 wood.png")
    'wood.png'
    """
    words = name.strip().split()
    while words and words[0].startswith("-") and len(words) > 1:
        words.pop(0)
        # options take numbers or on/off; the rest is the name, which may have spaces
        while len(words) > 1 and re.fullmatch(r"[-+]?[\d.]+([eE][-+]?\d+)?|on|off|[rgbmlz]", words[0]):
            words.pop(0)
    return " ".join(words) if name.strip().startswith("-") else name.strip()


def check_picture(data: bytes, where: str) -> None:
    """Raise InputError for a picture that announces too many texels; other defects are left to decoding."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            # pillow warns and then raises for bombs; the limit here is ours and comes with our text
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(BytesIO(data)) as picture:
                width, height = picture.size
    except Image.DecompressionBombError:
        raise InputError(f"{where}: a picture of absurd size; scale it down") from None
    except (OSError, SyntaxError, ValueError):
        return
    check_texels(width, height, where)
