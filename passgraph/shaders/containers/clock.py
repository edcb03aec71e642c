"""Time for shaders: seconds computed from the frame number, so that runs are reproducible."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any

from passgraph.graph.run_values import FRAME_INDEX
from passgraph.language.types import FLOAT, VEC4
from passgraph.shaders import STEP_S
from passgraph.shaders.containers.effect import ShaderParameter

#: GLSL before a shader; formats define their own names from these.
PRELUDE = """
uniform int pg_frame;
uniform float pg_start;
uniform float pg_step;
uniform vec4 pg_date;
"""
#: The time of a frame in seconds, as an expression of these uniforms.
SECONDS = "pg_start + float(pg_frame) * pg_step"
#: Uniform → the parameter that sets it.
_SET_BY = {"pg_start": "time", "pg_step": "time_step", "pg_date": "date"}
_PARAMETERS = {
    "time": ShaderParameter("time", FLOAT, 0.0, label="seconds at frame 0"),
    "time_step": ShaderParameter("time_step", FLOAT, STEP_S, label="seconds from frame to frame", is_frame_time=True),
    "date": ShaderParameter("date", VEC4, (2000.0, 1.0, 1.0, 0.0), label="year, month, day, seconds of the day"),
}


def clock_parameters(used: Iterable[str], taken: Collection[str] = ()) -> dict[str, ShaderParameter]:
    """Return parameters for the clock's uniforms that kernels use; ``taken`` are the shader's own names."""
    named = {_SET_BY[name] for name in used if name in _SET_BY}
    return {
        (ours := _free_name(name, taken)): replace(parameter, name=ours)
        for name, parameter in _PARAMETERS.items()
        if name in named
    }


def clock_uniforms(values: Mapping[str, Any], taken: Collection[str] = ()) -> dict[str, Any]:
    """Return the clock's uniforms from parameters."""
    names = {own: _free_name(name, taken) for own, name in _SET_BY.items()}
    return {"pg_frame": FRAME_INDEX} | {own: values[name] for own, name in names.items() if name in values}


def _free_name(name: str, taken: Collection[str]) -> str:
    """Return the name of a clock parameter, changed if the shader has a parameter of that name.

    >>> _free_name("time", ()), _free_name("time", ("time",))
    ('time', 'clock_time')
    """
    while name in taken:
        name = f"clock_{name}"
    return name
