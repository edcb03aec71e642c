"""Checks of a model file before anything is allocated, and a reader that is confined to its folder.

Model files are untrusted: counts are checked against the file's size, and the paths of textures and material files may
not leave the model's folder.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.reading import check_regular, read_bytes

SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
# A model of 1 GiB has some 30 million triangles; loading needs several times its size.
MAX_FILE_BYTES = 1 << 30
# One white texel (PGM), passed to trimesh instead of every picture.
EMPTY_PICTURE = b"P5 1 1 255\n\xff"


def checked_path(path: str | PathLike[str], max_bytes: int = MAX_FILE_BYTES) -> Path:
    """Return the path of a readable model file; raise InputError for an unknown format or a file that is too large."""
    file = arguments.path(path, "the model to load")
    size = check_regular(file, f"a model file ({', '.join(SUFFIXES)})")
    if file.suffix.lower() not in SUFFIXES:
        got = file.suffix or "no suffix"
        raise InputError(f"{file}: unknown kind of model ({got}); expected one of {', '.join(SUFFIXES)}")
    if size == 0:
        raise InputError(f"{file}: the file is empty (0 bytes)")
    if size > max_bytes:
        raise InputError(f"{file}: {size} bytes are more than the limit of {max_bytes}; simplify the model")
    _check_counts(file, size)
    return file


def _check_counts(file: Path, size: int) -> None:
    """Raise InputError for headers that declare more elements than the file has bytes, before they are allocated."""
    if file.suffix.lower() not in (".ply", ".off", ".stl"):
        return
    head = read_model(file)[: 1 << 16]
    if file.suffix.lower() == ".stl":
        # a header of 80 bytes, the number of triangles, 50 bytes each; text begins with "solid"
        count = int.from_bytes(head[80:84], "little")
        if not head.lstrip().startswith(b"solid") and (len(head) < 84 or 84 + 50 * count > size):
            raise InputError(f"{file}: truncated, {count} triangles take {84 + 50 * count} bytes and {size} are there")
        return
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


def read_model(file: Path) -> bytes:
    """Return all bytes of a model file."""
    return read_bytes(file, "a model file", MAX_FILE_BYTES, "simplify the model")


class FolderReader:
    """Read files named in a model, only below the model's folder; trimesh calls it as its resolver.

    Attributes
    ----------
    missing : names of missing files
    refused : messages about names that must not be read
    materials : the materials of MTL files: for each name, its lines by their first word in lower case
    picture : the name of the picture of a file without materials (PLY)
    folders : folders to search: the model's, then those of its MTL files, which hold their pictures
    """

    def __init__(self, model: Path) -> None:
        self.folder = model.resolve().parent
        self.file_name = model.name
        self.missing: list[str] = []
        self.refused: list[str] = []
        self.materials: dict[str, dict[str, str]] = {}
        self.picture: str | None = None
        self.folders = [self.folder]

    def find(self, name: str) -> Path | None:
        """Return the path of a file that the model names, or None (noted in ``missing`` or ``refused``)."""
        clean = unquote(name.replace("\\", "/"))
        outside = clean.startswith(("/", "~")) or bool(PureWindowsPath(clean).drive) or "\0" in clean
        # resolve follows links, so that neither '..' nor a link can leave the folder
        paths = [] if outside else [(folder / clean).resolve() for folder in self.folders]
        paths = [path for path in paths if path.is_relative_to(self.folder)]
        if not paths:
            self._note(self.refused, f"{name!r} leads out of the folder of the model")
            return None
        path = next((path for path in paths if path.exists()), None)
        if path is None:
            self._note(self.missing, clean)
            return None
        if not path.is_file():
            self._note(self.refused, f"{name!r} is no regular file")
            return None
        if path.stat().st_size > MAX_FILE_BYTES:
            self._note(self.refused, f"{name!r} has more than {MAX_FILE_BYTES} bytes")
            return None
        return path

    def read(self, name: str) -> bytes | None:
        """Return the bytes of a file that the model names, or None (noted in ``missing`` or ``refused``)."""
        path = self.find(name)
        return None if path is None else read_bytes(path, f"a file of {self.file_name}", MAX_FILE_BYTES)

    def get(self, name: str) -> bytes:
        """Return a material file to trimesh, but no pictures, which it would open in any format.

        The materials are stored in ``materials``, and the last picture's name in ``picture``.
        """
        if not name.lower().endswith(".mtl"):
            self.picture = name
            return EMPTY_PICTURE
        path, data = self.find(name), self.read(name)
        if path is None or data is None:
            raise FileNotFoundError(name)
        if path.parent not in self.folders:
            self.folders.append(path.parent)
        text = as_utf8(data)
        self.materials |= materials_of(text.decode())
        return text

    __getitem__ = get

    def keys(self) -> Iterator[str]:
        """List no names; they are not needed."""
        return iter(())

    def __contains__(self, name: str) -> bool:
        return self.find(name) is not None

    @staticmethod
    def _note(notes: list[str], text: str) -> None:
        if text not in notes:
            notes.append(text)


def materials_of(text: str) -> dict[str, dict[str, str]]:
    """Return the lines of an MTL file by material and first word.

    >>> materials_of("newmtl a b\\n map_Kd  my wood.png \\n")
    {'a b': {'map_kd': 'my wood.png'}}
    """
    materials: dict[str, dict[str, str]] = {}
    lines: dict[str, str] = {}
    for line in text.splitlines():
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        if key.lower() == "newmtl":
            lines = materials.setdefault(" ".join(rest.split()), {})
        elif key and not key.startswith("#"):
            lines[key.lower()] = rest.strip()
    return materials


def as_utf8(data: bytes) -> bytes:
    """Convert text to UTF-8, from UTF-8, UTF-16 with a byte order mark, or else Latin-1; files declare no encoding.

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
    """Return the file name of an MTL texture line without its options.

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


@dataclass
class Notes:
    """Notes about a file, collected while it is read; equal notes are merged.

    >>> notes = Notes()
    >>> for name in "abcde":
    ...     notes.add("its emissive light is not shown", f"material {name!r}")
    >>> notes.lines()
    ["material 'a', material 'b', material 'c' and 2 more: its emissive light is not shown"]
    """

    found: dict[str, list[str]] = field(default_factory=dict)

    def add(self, what: str, where: str) -> None:
        """Add a note; ``what`` is the feature and its treatment, ``where`` the object."""
        names = self.found.setdefault(what, [])
        if where not in names:
            names.append(where)

    def lines(self) -> list[str]:
        """Return a line for each note, with at most three names."""
        return [f"{_listed(names)}: {what}" for what, names in self.found.items()]


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:3])
    return shown if len(names) <= 3 else f"{shown} and {len(names) - 3} more"
