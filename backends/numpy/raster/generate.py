"""Makes the text of the rasteriser's fixed functions (``fixed/*.ll``) anew, after a change of what they are written in.

    python -m passgraph.backends.numpy.raster.generate

Needs numba: ``pip install 'passgraph[dev]'``.  A text that is older than its functions is not used: where numba is
there they are compiled by it in every process, which takes seconds; tests/backends/test_numpy_fixed.py says so.
"""

from __future__ import annotations

from passgraph.backends.numpy.raster.entries import FIXED


def main() -> None:
    for code in FIXED:
        code.shipped.write(code.name, code.made())


if __name__ == "__main__":
    main()
