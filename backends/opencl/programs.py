"""Build generated source, once per process and source; pyopencl or the driver cache binaries on disk."""

from __future__ import annotations

import re
import warnings
from typing import Any

from passgraph.backends.opencl.opencl_c import package_text
from passgraph.backends.opencl.trial import trial_of
from passgraph.backends.printing import Listing
from passgraph.cached import Recent
from passgraph.errors import BackendError
from passgraph.language.source import NOWHERE

#: ``file.cl:12:5: error: …`` (clang, so PoCL, Intel, AMD) and ``<kernel>:12:5: error: …`` (NVIDIA).
MESSAGE = re.compile(r":(\d+):\d+:\s*(?:fatal )?error")
#: Platforms, and the macro that marks OpenCL C as already declared: the include guard of clang's header.  Otherwise the
#: compiler would read 18,000 lines of declarations twice for each program: 0.08 s, or 0.015 s with a cached program.
#: declared.cl replaces them.
POCL, ALL_DECLARED = "Portable Computing Language", "-D_OPENCL_H_"
#: Most sources whose programs are kept, and layouts for which one pass keeps its kernels.
MOST_BUILT, MOST_LAYOUTS = 1024, 64
#: Most characters of a driver's log in an error.
LOG_CHARACTERS = 2000


class Programs:
    """Built programs of one context by source text.

    ``declares`` means that kernels include our own declarations of the functions that they call.
    """

    def __init__(self, context: Any, device: Any) -> None:
        import pyopencl as cl

        self.context, self.device = context, device
        rounded = device.single_fp_config & cl.device_fp_config.CORRECTLY_ROUNDED_DIVIDE_SQRT
        self.rounds_quotients = bool(rounded)
        self.options = ["-cl-std=CL1.2", *(["-cl-fp32-correctly-rounded-divide-sqrt"] if rounded else [])]
        self.built: dict[str, Any] = Recent(MOST_BUILT)
        self.declares = device.platform.name == POCL
        self.trial = trial_of(device)

    def build(self, listing: Listing, what: str, grouped: bool = True) -> Any:
        """Return the built program of a source.

        ``grouped``: False if each group of its kernels has one work-item, which no known driver fails over (`Trial`).

        Raises
        ------
        BackendError
            If the driver rejects it, with the kernel's file and line and the driver's message.
        """
        import pyopencl as cl

        if listing.text not in self.built:
            try:
                with warnings.catch_warnings():
                    # Compilers write messages even on success.
                    warnings.simplefilter("ignore", cl.CompilerWarning)
                    self.built[listing.text] = self._built(listing.text, grouped)
            except cl.Error as error:
                raise build_error(listing, what, str(error)) from None
        return self.built[listing.text]

    def _built(self, text: str, grouped: bool) -> Any:
        import pyopencl as cl

        if self.declares:
            try:
                return self._compiled(*self.sent(text, grouped))
            except cl.Error:
                pass  # it may need the driver's own; if not, the standalone source has the error's line
        built = self._compiled(*self._tried(text, self.options, grouped))
        self.declares = False
        return built

    def _compiled(self, source: str, options: list[str]) -> Any:
        import pyopencl as cl

        return cl.Program(self.context, source).build(options, [self.device])

    def sent(self, text: str, grouped: bool = True) -> tuple[str, list[str]]:
        """Return the source that is compiled for a text, and the compiler's options."""
        if self.declares:
            return self._tried(package_text("declared.cl") + text, [*self.options, ALL_DECLARED], grouped)
        return self._tried(text, self.options, grouped)

    def _tried(self, source: str, options: list[str], grouped: bool) -> tuple[str, list[str]]:
        return self.trial.safe(source, options) if self.trial is not None and grouped else (source, options)

    def close(self) -> None:
        if self.trial is not None:
            self.trial.close()
        self.built.clear()


def build_error(listing: Listing, what: str, log: str) -> BackendError:
    """Return an error with the kernel line behind the first error in a compiler's log."""
    match = MESSAGE.search(log)
    span = listing.span_at(int(match.group(1))) if match else NOWHERE
    if span == NOWHERE:
        span = next((one for one in listing.spans if one != NOWHERE), NOWHERE)
    message = f"the OpenCL driver refuses {what}; this is a defect of passgraph or of the driver. It said:"
    return BackendError(f"{span.point_at(message)}\n{log.strip()[:LOG_CHARACTERS]}")
