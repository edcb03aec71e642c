#!/usr/bin/env bash
# Guess: FFmpeg's scale filter reads 4:2:0 chroma where the frame says that it lies (AVFrame.chroma_location; H.264's
#     decoder sets "left"), since the swscale call below it (sws_scale_frame) does.
# Is: the filter ignores the frame's location and takes the center, so that colors of H.264 lie half a luma pixel to the
#     right. Only its option in_chroma_loc moves them. The same frame through sws_scale_frame, which PyAV's reformat
#     calls, is right.
# Seen with: PyAV 18.1.0, its wheel has libavfilter 11.14.102 and libswscale 9.5.102 (FFmpeg 8.1); numpy 2.3.5.
#     Places of samples: ITU-T H.264, figure E-1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check av==18.1.0 numpy==2.3.5
venv/bin/python - <<'PYTHON'
from itertools import pairwise

import av
import numpy as np
from av.filter import Graph


def decoded():
    """A frame of lossless H.264, which has chroma on every second luma column; blue-difference is a ramp across."""
    with av.open("a.mkv", "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": "0"})
        stream.width, stream.height, stream.pix_fmt = 16, 16, "yuv420p"
        frame = av.VideoFrame(16, 16, "yuv420p")
        for plane, row in zip(frame.planes, ([120] * 16, range(100, 164, 8), [128] * 8), strict=True):
            rows = np.zeros((plane.height, plane.line_size), np.uint8)
            rows[:, : plane.width] = list(row)
            plane.update(rows.tobytes())
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with av.open("a.mkv") as container:
        return next(container.decode(video=0))


def blue(frame):
    return np.frombuffer(frame.planes[1], np.uint8).reshape(16, -1)[8, 4:12].tolist()


def filtered(options):
    graph = Graph()
    steps = [graph.add("buffer", "video_size=16x16:pix_fmt=yuv420p:time_base=1/25"), graph.add("scale", options)]
    steps += [graph.add("format", "pix_fmts=yuv444p"), graph.add("buffersink")]
    for one, other in pairwise(steps):
        one.link_to(other)
    graph.configure()
    graph.push(decoded())
    return blue(graph.pull())


left = [100 + 4 * column for column in range(4, 12)]  # sample k at column 2 k
center = [100 + 4 * column - 2 for column in range(4, 12)]  # sample k at column 2 k + 1/2
found = {
    "scale": filtered("flags=bilinear"),
    "scale with in_chroma_loc=left": filtered("flags=bilinear:in_chroma_loc=left"),
    "sws_scale_frame": blue(decoded().reformat(format="yuv444p", interpolation="BILINEAR")),
}
for name, columns in found.items():
    print(f"{name}: {columns}")
print(f"by H.264: {left}")
assert found == {"scale": center, "scale with in_chroma_loc=left": left, "sws_scale_frame": left}, "changed"
PYTHON
