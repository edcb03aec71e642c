#!/usr/bin/env bash
# 1. Most would guess: eglGetPlatformDisplay with another device type (ANGLE's software device, the system's Vulkan) gives
#    another display. EGL 1.5, section 3.2: the same handle is returned for calls with the same parameters.
# 2. What is: ANGLE returns the display that it has for this window system, whatever the attributes. Both say that they are
#    initialized, and both draw on the device that was asked for first. So a process compares two devices with one.
# 3. ANGLE 2.1.24077 (Chromium 131), from the npm package @sparticuz/chromium 131.0.1; seen on Debian 12 with Mesa's
#    lavapipe (mesa-vulkan-drivers) as the system's Vulkan. Needs npm.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
python3 -m venv venv
venv/bin/pip install -q brotli==1.1.0
npm pack --silent @sparticuz/chromium@131.0.1 >/dev/null
tar xzf sparticuz-chromium-131.0.1.tgz package/bin/swiftshader.tar.br
venv/bin/python - <<'EOF'
import brotli, io, subprocess, sys, tarfile

tarfile.open(fileobj=io.BytesIO(brotli.decompress(open("package/bin/swiftshader.tar.br", "rb").read()))).extractall("angle")
code = '''
import ctypes, sys
P, I, U = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint
library = ctypes.CDLL("angle/libEGL.so")
def f(name, result, *arguments): return ctypes.CFUNCTYPE(result, *arguments)((name, library))
def numbers(*of): return (I * (len(of) + 1))(*of, 0x3038)
# EGL_PLATFORM_ANGLE_TYPE_ANGLE = Vulkan, native platform: surfaceless; with a device type: SwiftShader.
vulkan = 0x3203, 0x3450, 0x348F, 0x31DD
wanted = {"system": vulkan, "software": (*vulkan, 0x3209, 0x3487)}
address = f("eglGetProcAddress", P, ctypes.c_char_p)
displays = []
for name in sys.argv[1:]:
    attributes = numbers(*wanted[name])
    display = f("eglGetPlatformDisplayEXT", P, U, P, P)(0x3202, None, attributes)
    ok = f("eglInitialize", U, P, P, P)(display, None, None)
    context = f("eglCreateContext", P, P, P, P, P)(display, None, None, numbers(0x3098, 3))
    f("eglMakeCurrent", U, P, P, P, P)(display, None, None, context)
    text = ctypes.CFUNCTYPE(ctypes.c_char_p, U)(address(b"glGetString"))(0x1F01).decode()
    displays.append(display)
    print(name, ok, "SwiftShader" if "SwiftShader" in text else "other", displays.index(display))
'''

def seen(*order):
    done = subprocess.run([sys.executable, "-c", code, *order], capture_output=True, text=True, check=True)
    found = [line.split() for line in done.stdout.splitlines()]
    print(*order, "->", found)
    return found

alone = [seen("system")[0], seen("software")[0]]
assert [one[1:3] for one in alone] == [["1", "other"], ["1", "SwiftShader"]], "needs a Vulkan driver of the system"
for first, second in (("system", "software"), ("software", "system")):
    one, two = seen(first, second)
    assert one[1:] == two[1:], "ANGLE gives each device a display now"
EOF
