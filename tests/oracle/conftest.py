"""Makes the helpers of these tests, of the language's and of the draws' importable."""

import sys
from pathlib import Path

here = Path(__file__).parent
sys.path[:0] = [str(here), str(here.parent / "language"), str(here.parent / "cross")]
