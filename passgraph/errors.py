"""Every error that passgraph raises on purpose, all below one class.

A message says what is wrong, where, what was expected, what was got and how to mend it.
"""

from __future__ import annotations


class PassgraphError(Exception):
    """Base of every deliberate error; commands print it and exit with status 2."""


class KernelError(PassgraphError):
    """Kernel source that the language refuses; the message shows file, line, source line and caret."""


class KernelLengthError(KernelError):
    """A kernel is longer than what drivers compile in time."""


class GraphError(PassgraphError):
    """Passes and targets that do not fit together; the message names the pass and the target."""


class UnknownNameError(GraphError, KeyError):
    """A result, effect or parameter that is not there; a KeyError too, as mappings have to raise."""

    __str__ = Exception.__str__  # KeyError shows the repr of its text


class InputError(PassgraphError):
    """A picture, mesh, array, size or option that cannot be used."""


class BackendError(PassgraphError):
    """A backend that is unknown, failed, or ran out of memory."""


class DeviceMissingError(BackendError):
    """A driver or device that is not here; the message has the command that installs it."""
