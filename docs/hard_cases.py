"""Measures every hard case of shadows and writes docs/hard-cases.md with its pictures: python docs/hard_cases.py

Each case is a function of ``tests/effects/hard``; the tests read the same ones.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from datetime import date
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

root = Path(__file__).resolve().parent.parent
if str(root) not in sys.path:
    sys.path.insert(0, str(root))

if TYPE_CHECKING:
    from tests.effects.hard.case import Case

PAGE = root / "docs" / "hard-cases.md"
PICTURES = root / "docs" / "images" / "hard-cases"
PARTS = ("bias", "precision", "penumbrae", "blurring", "lights", "moments", "refusals")
GAP_PX, LABEL_PX = 6, 20
HEADER = """# Hard cases

This page shows where shadows go wrong. Each case is a scene, a variant that fails, and the method that passgraph uses,
compared with ray tracing (`passgraph.truth`).

`python docs/hard_cases.py` measures everything on the `numpy` backend and writes this page. The tests in
`tests/effects/test_hard_cases.py` and `test_shadow_claims.py` hold the same figures on every backend.

- Shares are shares of the light, from 0 to 1.
- RMSE is taken over pixels whose surface faces the light.
- Widths are from 0.1 to 0.9, in scene units.
- Times are the least CPU time of several frames, over all threads.
"""
ELSEWHERE = """## Cases that are tested elsewhere

| Case | Where |
|---|---|
| NaN or infinity in an input picture | `tests/test_finite_inputs.py` |
| A 2-D light at exactly 45°, or touching a narrow caster | `tests/effects/test_light2d.py` |
| Variance and moment maps: all figures of their filters | `tests/effects/test_shadow_moments.py` |
"""


def cases() -> list[Callable[[str], Case]]:
    """Every case, in the order of the page."""
    return [case for part in PARTS for case in import_module(f"tests.effects.hard.{part}").CASES]


def strip(case: Case) -> Image.Image:
    """Labelled pictures side by side."""
    font = ImageFont.load_default(12)
    pictures = [(label, _bytes(picture)) for label, picture in case.strip]
    width = sum(p.shape[1] for _, p in pictures) + GAP_PX * (len(pictures) - 1)
    made = Image.new("RGB", (width, LABEL_PX + max(p.shape[0] for _, p in pictures)), "white")
    left = 0
    for label, picture in pictures:
        made.paste(Image.fromarray(picture), (left, LABEL_PX))
        ImageDraw.Draw(made).text((left + 2, 2), label, fill="black", font=font)
        left += picture.shape[1] + GAP_PX
    return made


def _bytes(picture: NDArray[Any]) -> NDArray[np.uint8]:
    rgb = picture if picture.ndim == 3 else np.repeat(picture[:, :, None], 3, axis=2)
    return np.round(np.clip(np.nan_to_num(rgb), 0.0, 1.0) * 255.0).astype(np.uint8)


def number(value: float | None, digits: int) -> str:
    """Plain digits; a small number that would round to nothing keeps two of its own."""
    if value is None:
        return ""
    text = f"{value:.{digits}f}"
    return f"{value:.1e}" if value != 0.0 and digits > 0 and float(text) == 0.0 else text


def section(case: Case) -> str:
    """One case as Markdown."""
    columns = [i for i in range(3) if case.labels[i]]
    rows = [("", *(case.labels[i] for i in columns)), ("---", *("--:" for _ in columns))]
    for figure in case.figures:
        values = (figure.truth, figure.failing, figure.remedy)
        rows.append((figure.what, *(number(values[i], figure.digits) for i in columns)))
    table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    parts = [f"## {case.title}", f"**What goes wrong.** {case.wrong}", f"**Here.** {case.remedy}", table]
    if case.notes:
        parts.append("\n".join(f"- {note}" for note in case.notes))
    if case.strip:
        parts.append(f"![{case.title}](images/hard-cases/{case.key}.png)")
    return "\n\n".join(parts) + "\n"


def main() -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    texts, every, begin = [], cases(), time.perf_counter()
    for index, case_of in enumerate(every):
        print(f"[{index + 1}/{len(every)}] {case_of.__name__} …", end="", flush=True, file=sys.stderr)
        start = time.perf_counter()
        case = case_of("numpy")
        if case.strip:
            # few tones are there; a palette keeps files small
            strip(case).quantize(128).save(PICTURES / f"{case.key}.png", optimize=True)
        texts.append(section(case))
        print(f" {time.perf_counter() - start:.1f} s", file=sys.stderr)
    PAGE.write_text("\n".join([HEADER, f"Taken {date.today()}.\n", *texts, ELSEWHERE]), encoding="utf-8")
    print(f"{PAGE.relative_to(root)} written in {time.perf_counter() - begin:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
