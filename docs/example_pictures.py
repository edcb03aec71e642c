"""Pictures of the gallery: what sphinx-gallery shows of a script is every PNG file that it wrote."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

#: A figure; `target` is where Sphinx puts pictures, seen from a page of the gallery, and the class keeps the theme from
#: dimming the picture on dark pages.
FIGURE = """
   .. figure:: /{source}
      :alt: {caption}
      :class: dark-light
      :target: ../../_images/{name}

      {caption}
"""


def saved_pictures(block: object, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Move the PNG files that a code block wrote to the gallery, and return their reStructuredText, oldest first.

    This is an image scraper of sphinx-gallery. Scripts run in their own folder. A file's name is its caption.
    """
    folder = Path(block_vars["src_file"]).parent
    written = sorted(folder.glob("*.png"), key=lambda file: file.stat().st_mtime_ns)
    figures = []
    for file, path in zip(written, block_vars["image_path_iterator"], strict=False):
        shutil.move(file, path)
        source = Path(path).relative_to(gallery_conf["src_dir"]).as_posix()
        figures.append(FIGURE.format(source=source, name=Path(path).name, caption=file.stem))
    kind = "pictures" if len(figures) > 1 else "picture"
    return f"\n.. container:: {kind}\n{''.join(figures)}\n" if figures else ""
