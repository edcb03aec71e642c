#!/usr/bin/env bash
# 1. Most would guess: with cffi's ABI mode, `ffi.new("point *")` parses those few characters, once.
# 2. What is: each new type string is parsed behind a line for every typedef that the library has declared, so a program
#    that uses many types of a large header parses the header's names again for each: 12 ms a type and 0.8 s a program
#    with wgpu's 430 typedefs. One string with all types as parameters of a function is parsed once, and its `args` are
#    the types, which `ffi.new` takes in place of strings.
# 3. cffi 2.1.1, cffi/cparser.py, Parser._parse ("for more efficiency we would need to poke into the internals").
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet "cffi==2.1.1"
cat > measure.py <<'PY'
import sys
import time

import cffi
from pycparser import c_parser

TYPES = 400
parsed, parse = [], c_parser.CParser.parse


def counted(self, text, *given, **named):
    parsed.append(text.count("typedef "))
    return parse(self, text, *given, **named)


def library():
    ffi = cffi.FFI()
    ffi.cdef("".join(f"typedef struct {{ int x; }} t{n};" for n in range(TYPES)))
    parsed.clear()
    return ffi


c_parser.CParser.parse = counted
found = {}
for way in ("one by one", "together"):
    ffi, begin = library(), time.process_time()
    if way == "one by one":
        values = [ffi.new(f"t{n} *") for n in range(50)]
    else:
        types = ffi.typeof(f"void(*)({', '.join(f't{n} *' for n in range(50))})").args
        values = [ffi.new(kind) for kind in types]
    found[way] = sum(parsed)
    print(f"50 of {TYPES} types, {way}: {found[way]} typedefs parsed, {1000 * (time.process_time() - begin):.0f} ms")
sys.exit(0 if found["one by one"] > 50 * TYPES and found["together"] < 2 * TYPES else 1)
PY
venv/bin/python measure.py
