"""A child process that compiles OpenCL programs, started by trial.py: ``python trial_child.py VERSION NUMBER``.

The arguments are the version of a platform and the number of its device.  Prints a line once the device is open.  Reads
lines of JSON, ``[source, options]``, and prints a line for each program that has not ended the process.
"""

from __future__ import annotations

import json
import sys
from contextlib import suppress


def main(version: str, number: str) -> None:
    import pyopencl as cl

    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # it may be ended
    platform = next(one for one in cl.get_platforms() if one.version == version)
    device = platform.get_devices()[int(number)]
    context = cl.Context([device])
    print("ready", flush=True)
    for line in sys.stdin:
        source, options = json.loads(line)
        with suppress(cl.Error):  # the parent gets the same error
            # PoCL makes its binaries of kernels compiled for groups of any size.
            cl.Program(context, source).build(options, [device]).get_info(cl.program_info.BINARIES)
        print("compiled", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
