#!/usr/bin/env bash
# Formats, lints, type-checks and tests passgraph: bash tests/run.sh [--quick] [arguments for pytest]
#
#   --quick           between edits: the language, the plan, a case of each kind and effect on every backend, the
#                     documentation's examples; everything else, and of these what grows, is hostile or made up at
#                     random, waits for the whole run
#
#   PYTHON            the interpreter to build the virtual environment with (default: python3, 3.11 or later)
#   PASSGRAPH_VENV    where that environment is (default: .venv-tests in the checkout)
#   PASSGRAPH_EXPECT  devices that must be here; a missing one fails, it does not skip (default:
#                     gl,opencl,webgpu,numpy). With them, each system package that the distribution has must install,
#                     and each Python package that pyproject.toml names for this Python. Tests that need another one
#                     are skipped; pytest's last lines count them by what they need
#   GALLIVM_PERF      how Mesa's software renderer compiles shaders (default: nopt, not optimised, which saves a third
#                     of the time of tests that draw; tests/conformance/test_driver.py, slow, has it as users do).
#                     Empty, it is as users have it throughout, and so it is where the arguments choose marks, as
#                     -m "" does: who waits for the slow tests waits for these too
#   SECOND_PYTHON     another interpreter for the tests of the language, plans and videos, in an environment of few
#                     packages (default: the newest of Python 3.11 to 3.14 here, on the path or of pyenv, that is not
#                     PYTHON's; empty: none). Only a run without arguments has it
#   POCL_EXTRA_BUILD_FLAGS  the same for PoCL's compiler of OpenCL kernels (default: -cl-opt-disable, half of its time)
#
# Every step runs, also after one has failed; the exit status is 0 only if all passed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

whole=$((1 - ($# > 0)))
tests=()
# What depends on Python itself.
of_python=(tests/language --ignore=tests/language/test_hostile.py --ignore=tests/language/test_fragment_derivatives.py
           tests/plan --ignore=tests/plan/test_growth.py --ignore=tests/plan/test_random_graphs.py)
if [ "${1-}" = --quick ]; then
    shift
    tests=("${of_python[@]}" tests/conformance/test_first_cases.py
           tests/test_layout.py tests/test_execution.py
           tests/mutation/test_mutants.py::test_every_mistake_can_still_be_planted passgraph docs README.md)
fi

case " $* " in
    *" -m"*) ;;
    *)
        export GALLIVM_PERF=${GALLIVM_PERF-nopt}
        # Kernels that are not optimised keep all of a work-group's variables on the stacks of PoCL's threads.
        if ulimit -s 65536 2>/dev/null; then
            export POCL_EXTRA_BUILD_FLAGS=${POCL_EXTRA_BUILD_FLAGS--cl-opt-disable}
        fi
        ;;
esac

heading() { printf '\n=== %s\n' "$*"; }
stop() {
    printf 'tests/run.sh: %s\n' "$*" >&2
    exit 2
}

failed=()
venv=${PASSGRAPH_VENV:-.venv-tests}
export PASSGRAPH_EXPECT=${PASSGRAPH_EXPECT-gl,opencl,webgpu,numpy}
# OpenBLAS's threads spin after each import of numpy, of which the tests have hundreds.
export OPENBLAS_THREAD_TIMEOUT=${OPENBLAS_THREAD_TIMEOUT-4}

python=${PYTHON:-python3}
command -v "$python" >/dev/null ||
    stop "no $python here; install Python 3.11 or later (sudo apt-get install python3 python3-venv), or set PYTHON"
version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    stop "$(command -v "$python") is Python $version; passgraph needs 3.11 or later; set PYTHON to a newer one"

# Debian and Ubuntu ship Python without venv; an interpreter from elsewhere has it.
lacks_venv() { ! "$python" -c 'import ensurepip, venv' 2>/dev/null; }

heading "system packages"
# Runs apt-get as root, through sudo where that needs no password or can ask for one.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    elif command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [ -t 0 ]; }; then
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    else
        return 1
    fi
}
installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }
missing=()
if ! command -v dpkg-query >/dev/null; then
    echo "not Debian or Ubuntu: install OpenGL with EGL and Vulkan (Mesa), an OpenCL loader and PoCL, oclgrind and Chromium yourself"
else
    for package in libegl1 libgl1 libgl1-mesa-dri libgles2 mesa-vulkan-drivers ocl-icd-libopencl1 pocl-opencl-icd oclgrind xvfb \
        chromium; do
        installed "$package" || missing+=("$package")
    done
    if lacks_venv && [ ! -x "$venv/bin/pip" ]; then missing+=("python$version-venv"); fi
    if [ ${#missing[@]} -eq 0 ]; then
        echo "all here"
    else
        echo "missing: ${missing[*]}"
        left=()
        if as_root apt-get update -q; then
            # One at a time: a distribution that lacks one of them still gets the others.
            for package in "${missing[@]}"; do
                if [ -z "$(apt-cache madison "$package")" ]; then
                    echo "$package is not in this distribution; tests that need it are skipped"
                else
                    as_root apt-get install -q -y --no-install-recommends "$package" || left+=("$package")
                fi
            done
        else
            left=("${missing[@]}")
        fi
        if [ ${#left[@]} -gt 0 ]; then
            failed+=("installation of ${left[*]}")
            echo "could not install them here. Install them with:"
            echo "    sudo apt-get update && sudo apt-get install ${left[*]}"
        fi
    fi
fi

# Makes a virtual environment, again when what it depends on changes: dependencies, checkout, interpreter.
environment() {
    local venv=$1 key
    [ -x "$venv/bin/pip" ] || "$2" -m venv "$venv" || return
    key="$(sha256sum pyproject.toml | cut -d' ' -f1) $PWD $("$venv/bin/python" -V)"
    if [ "$(cat "$venv/passgraph-stamp" 2>/dev/null)" = "$key" ]; then
        echo "up to date"
        return
    fi
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check "${@:3}" || return
    printf '%s\n' "$key" >"$venv/passgraph-stamp"
}

heading "virtual environment $venv"
if [ ! -x "$venv/bin/pip" ] && lacks_venv; then
    stop "$(command -v "$python") has no venv module; run: sudo apt-get install python$version-venv"
fi
environment "$venv" "$python" -e '.[all,dev,docs]'
bin=$(cd "$venv/bin" && pwd)
# Tests that start the passgraph command find the one of this checkout.
export PATH="$bin:$PATH"
# Python keeps what it compiles, whatever the environment says: finding the tests takes half as long from the second time.
export PYTHONDONTWRITEBYTECODE=

step() {
    heading "$*"
    "$bin/$1" "${@:2}" || failed+=("$*")
}
step ruff format --check .
step ruff check .
step lint-imports
step mypy

# The newest supported Python here of another version than PYTHON.
another_python() {
    local minor found
    for minor in 14 13 12 11; do
        [ "3.$minor" != "$version" ] || continue
        for found in "python3.$minor" "${PYENV_ROOT:-$HOME/.pyenv}/versions/3.$minor".*/bin/python; do
            if "$found" -c 'import ensurepip, venv' 2>/dev/null; then
                echo "$found"
                return
            fi
        done
    done
}

if [ "$whole" -eq 1 ]; then
    second=${SECOND_PYTHON-$(another_python)}
    heading "tests on a second Python"
    if [ -z "$second" ]; then
        echo "none of Python 3.11 to 3.14 but $version is here: skipped"
    else
        second_version=$("$second" -V)
        echo "$second_version"
        { environment "$venv-second" "$second" -e '.[fuzz,gl,video]' pytest-xdist scipy &&
            PASSGRAPH_EXPECT=numpy "$venv-second/bin/python" -m pytest -q -n 2 -m "not slow" "${of_python[@]}" \
                tests/files/test_video.py; } ||
            failed+=("tests on $second_version")
    fi
fi

if [ ${#failed[@]} -gt 0 ]; then
    heading "failed before the tests"
    printf '%s\n' "${failed[@]}"
fi
# tests/test_layout.py repeats these failures, so that the last lines tell the whole result.
PASSGRAPH_FAILED_STEPS=$(printf '%s;' ${failed[@]+"${failed[@]}"})
export PASSGRAPH_FAILED_STEPS=${PASSGRAPH_FAILED_STEPS#;}

heading "pytest"
status=0
"$bin/python" -m pytest -n 2 --dist worksteal -m "not slow" --durations=10 ${tests[@]+"${tests[@]}"} "$@" || status=$?
if [ "$status" -eq 0 ] && [ ${#failed[@]} -gt 0 ]; then status=1; fi
exit "$status"
