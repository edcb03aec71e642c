#!/usr/bin/env bash
# Build the site: bash docs/build.sh [folder]. Needs pip install '.[docs]'. Warnings are errors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-docs/_build}
export PYTHONPATH="$PWD"
# Pages of names that no longer exist would stay.
rm -rf docs/api "$out/html"
exec "${PYTHON:-python3}" -m sphinx --fail-on-warning --keep-going --fresh-env --quiet --jobs auto -b html docs "$out/html"
