#!/usr/bin/env bash
# Guess: OpenColorIO's INTERP_NEAREST returns entries of a LUT, for example for a LUT of indices or steps.
# Is: 1-D LUTs are interpolated linearly, and 3-D LUTs trilinearly, by the CPU processor without optimizations too. No
#     warning is given, and the transform says INTERP_NEAREST when it is asked.
# Seen with: opencolorio 2.6.0, numpy 2.3.5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check opencolorio==2.6.0 numpy==2.3.5
venv/bin/python - <<'PYTHON'
from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio

corners = [(r, g, b) for b in (0, 1) for g in (0, 1) for r in (0, 1)]
Path("one.cube").write_text("LUT_1D_SIZE 3\n0 0 0\n0.9 0.9 0.9\n1 1 1\n")
Path("three.cube").write_text("LUT_3D_SIZE 2\n" + "".join(f"{r * g} {g * b} {b * r}\n" for r, g, b in corners))
color = np.array([[0.3, 0.6, 0.9, 1.0]], np.float32)
linear = {"one.cube": [0.54, 0.92, 0.98], "three.cube": [0.18, 0.54, 0.27]}
for name, expected in linear.items():
    transform = ocio.FileTransform(name, interpolation=ocio.INTERP_NEAREST)
    processor = ocio.Config.CreateRaw().getProcessor(transform)
    (lut,) = processor.createGroupTransform()
    found = color.copy()
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_NONE).applyRGBA(found)
    print(f"{name}: {lut.getInterpolation()}: {found[0, :3].round(3).tolist()}, linear: {expected}")
    assert lut.getInterpolation() == ocio.INTERP_NEAREST, "changed"
    assert np.allclose(found[0, :3], expected, atol=1e-5), "changed"
PYTHON
