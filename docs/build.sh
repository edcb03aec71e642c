#!/usr/bin/env bash
# Build the site: bash docs/build.sh [folder] [options of sphinx-build]. Needs pip install '.[docs]'. Warnings are errors.
# Scripts of the gallery run where they changed since the last build; to run them all, remove docs/gallery first.
# With "-D plot_gallery=0" none runs, and the gallery has no pictures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-docs/_build}
export PYTHONPATH="$PWD"
# Pages of names that no longer exist would stay.
rm -rf docs/api "$out/html"
exec "${PYTHON:-python3}" -m sphinx --fail-on-warning --keep-going --fresh-env --quiet --jobs auto -b html "${@:2}" docs "$out/html"
