"""Makes the text of the rasterizer's fixed functions (``fixed/*.ll``) anew, after a change of what they are written in.

    python -m passgraph.backends.numpy.raster.generate

Needs numba: ``pip install 'passgraph[dev]'``.  A text that is older than its functions is not used: numba compiles
them at their first use on a machine, which takes seconds, and tests/backends/test_numpy_fixed.py fails.
"""

from __future__ import annotations

from importlib.util import find_spec

from passgraph.backends.numpy.raster.entries import FIXED


def main() -> None:
    if find_spec("numba") is None:
        raise SystemExit(
            "the text of fixed functions is made by numba, which is not here: pip install 'passgraph[dev]'"
        )
    for code in FIXED:
        code.shipped.write(code.name, code.generate())


if __name__ == "__main__":
    main()
