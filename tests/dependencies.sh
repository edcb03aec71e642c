#!/usr/bin/env bash
# Tests passgraph with other versions of its dependencies: bash tests/dependencies.sh lowest|newest [arguments for pytest]
#
#   lowest   every package of the extra "all" in the lowest version that pyproject.toml names (Python: PYTHON, 3.11)
#   newest   each in its newest version; warnings are errors, those about removals to come too
#
#   PYTHON   the interpreter to build the virtual environment with (default: python3)
#
# Makes .venv-lowest or .venv-newest anew, from wheels alone, prints the versions, and runs tests that use each of the
# packages. By hand, before a release and after a change of versions in pyproject.toml; tests/run.sh has the versions of
# the day.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

which=${1-}
case "$which" in
    lowest) resolution=lowest-direct strict=() ;;
    newest) resolution=highest strict=(-W error) ;;
    *)
        sed -n '2,4p' "${BASH_SOURCE[0]}" >&2
        exit 2
        ;;
esac
shift

venv=.venv-$which
"${PYTHON:-python3}" -m venv --clear "$venv"
bin=$PWD/$venv/bin
"$bin/python" -m pip install --quiet --upgrade uv
# What the tests compare with is the newest that goes with it.
"$bin/uv" pip install --quiet --python "$bin/python" --resolution "$resolution" --only-binary :all: -e '.[all]'
"$bin/uv" pip install --quiet --python "$bin/python" --only-binary :all: imageio mpmath opencv-python-headless OpenEXR \
    packaging pytest-xdist scipy
"$bin/passgraph" --version --verbose

export PATH="$bin:$PATH" GALLIVM_PERF=${GALLIVM_PERF-nopt}
tests=(tests/conformance/test_first_cases.py tests/files tests/commands tests/test_pictures.py tests/test_scene_load.py
       tests/test_scene_gltf.py tests/effects/test_registry.py tests/effects/test_color_transform.py tests/bench
       tests/viewer tests/test_truth.py tests/test_notebook.py tests/fuzz passgraph/environment.py)
"$bin/python" "${strict[@]}" -m pytest -n 2 --dist worksteal -m "not slow" "${tests[@]}" "$@"
