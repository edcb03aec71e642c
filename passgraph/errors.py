"""Exceptions: every deliberate error is a subclass of `PassgraphError`.

A message says what is wrong, where, what was expected, what was got and how to mend it.
"""

from __future__ import annotations


class PassgraphError(Exception):
    """Base of every deliberate error; commands print it and exit with status 2."""


class KernelError(PassgraphError):
    """Kernel source outside the language; the message shows file, line, source line and caret."""


class KernelLengthError(KernelError):
    """A kernel past a limit: too long for drivers to compile in reasonable time, too deep, or with too long arrays."""


class UnsupportedGlslError(KernelError):
    """Valid GLSL that is not read here, such as cube maps."""


class GraphError(PassgraphError):
    """Passes and targets that do not fit together; the message names the pass and the target."""


class UnknownNameError(GraphError, KeyError):
    """An unknown result, effect or parameter; a KeyError too, as mappings require."""

    __str__ = Exception.__str__  # KeyError shows the repr of its text


class InputError(PassgraphError):
    """An unusable picture, mesh, array, size or option."""


class BackendError(PassgraphError):
    """An unknown backend, a backend failure or lack of device memory."""


class UnsupportedError(BackendError):
    """A graph that takes more than this device has: a format, a feature, or a size. Another device may run it."""


class DeviceMissingError(BackendError):
    """A missing driver or device; the message has the command that installs it."""


def reason(error: BaseException) -> str:
    """Return the text of an error on one line; of an error of the system without its number and file.

    >>> reason(FileNotFoundError(2, "No such file or directory", "a.png")), reason(ValueError())
    ('No such file or directory', 'ValueError')
    """
    return " ".join(str(getattr(error, "strerror", None) or error).split()) or type(error).__name__


def on_one_line(text: str) -> str:
    """Return the text of an error on one line; a text with a caret under a source line keeps its lines.

    >>> on_one_line("in.png: is no picture\\n  (cut short)")
    'in.png: is no picture (cut short)'
    >>> on_one_line("mine.py:3: name 'x' is not defined\\n    return x\\n           ^").count("\\n")
    2
    """
    has_caret = any(line.strip() and not line.strip(" \t^") for line in text.split("\n"))
    return text.rstrip() if has_caret else " ".join(text.split())
