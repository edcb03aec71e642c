"""Makes the helpers of these tests and of the language's importable."""

import sys
from pathlib import Path

here = Path(__file__).parent
sys.path[:0] = [str(here), str(here.parent / "language")]
