"""WebGPU in headless Chromium: the device of a page, driven from here through playwright.

wgpu-py has the names of the browser's API in snake case, so a call is sent as it is: `Remote` records the calls on an
object of the page, and sends them together when a result is read back, or when an error could be reported.
"""

from __future__ import annotations

import base64
import os
import shutil
import subprocess
from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any

import numpy as np

from passgraph.backends.base import SNAP_PX, DeviceInfo
from passgraph.errors import DeviceMissingError

INSTALL = "pip install 'passgraph[web]'"
#: Without the last three, drawing ends Chromium's GPU process where there is no display.
FLAGS = ("--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan",
         "--use-vulkan=swiftshader", "--use-angle=swiftshader", "--disable-vulkan-surface")  # fmt: skip
#: Chromium does not run as root with its sandbox; the page that it opens is ours alone.
_ROOT = ("--no-sandbox",) if hasattr(os, "geteuid") and os.geteuid() == 0 else ()
#: The grid of SwiftShader's triangle corners, the coarsest that Vulkan allows, in pixels.
SWIFTSHADER_PX = 1.0 / 16.0
#: A page of no server: WebGPU takes a secure origin, and the route below answers for it.
_ORIGIN = "https://passgraph.invalid/"
#: Calls that are sent together at most.
_MOST_CALLS = 2000
_OPEN = """async (wanted) => {
    const adapter = await navigator.gpu?.requestAdapter();
    if (!adapter) return null;
    const limits = {};
    for (const name in adapter.limits)
        if (typeof adapter.limits[name] === "number") limits[name] = adapter.limits[name];
    const requiredFeatures = wanted.filter((name) => adapter.features.has(name));
    const device = await adapter.requestDevice({ requiredFeatures, requiredLimits: limits });
    globalThis.objects = { 0: device, 1: device.queue };
    return [requiredFeatures, limits, `${adapter.info.vendor} ${adapter.info.architecture || adapter.info.device}`];
}"""
_RUN = """async ([calls, dropped]) => {
    const device = objects[0];
    const given = (one) => one === null || typeof one !== "object" ? one ?? undefined
        : Array.isArray(one) ? one.map(given)
        : "$object" in one ? objects[one.$object]
        : "$bytes" in one ? Uint8Array.from(atob(one.$bytes), (byte) => byte.charCodeAt(0))
        : Object.fromEntries(Object.entries(one).map(([name, part]) => [name, given(part)]));
    let error = "";
    device.pushErrorScope("validation");
    try {
        for (const [object, name, args, result] of calls)
            objects[result] = objects[object][name](...args.map(given));
    } catch (thrown) { error = String(thrown); }
    const found = await device.popErrorScope();
    for (const one of dropped) delete objects[one];
    return found ? found.message : error;
}"""
_READ = """async ([buffer, at, size]) => {
    await objects[buffer].mapAsync(GPUMapMode.READ, at, size);
    const bytes = new Uint8Array(objects[buffer].getMappedRange(at, size));
    let text = "";
    for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
    return btoa(text);
}"""


def executable() -> str | None:
    """Return the path of Chromium, or of Chrome; None where neither is installed."""
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def device_info() -> DeviceInfo:
    """Return Chromium as a device, without starting a page of it."""
    path = executable()
    if find_spec("playwright") is None:
        return DeviceInfo("", "", "", f"webgpu:chromium needs playwright; install it: {INSTALL}")
    if path is None:
        return DeviceInfo("", "", "", "there is no Chromium or Chrome on PATH; install one: apt-get install chromium")
    try:
        said = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=20, check=True).stdout
    except (OSError, subprocess.SubprocessError) as error:
        return DeviceInfo("", "", "", f"{path} cannot be started: {error}")
    return DeviceInfo("SwiftShader in headless Chromium", path, said.strip())


class Page:
    """A page of Chromium with a WebGPU device, and the calls that it has not made yet.

    It is used by the thread that opened it only, as playwright demands.
    """

    def __init__(self, features: tuple[str, ...]) -> None:
        try:
            from playwright.sync_api import sync_playwright
        except ImportError as error:
            raise DeviceMissingError(f"webgpu:chromium needs playwright ({error}); install it: {INSTALL}") from None
        self._playwright = sync_playwright().start()
        try:
            self._browser = self._playwright.chromium.launch(executable_path=executable(), args=[*_ROOT, *FLAGS])
            self._page = self._browser.new_page()
            self._page.route("**", lambda route: route.fulfill(body="<!doctype html>", content_type="text/html"))
            self._page.goto(_ORIGIN)
            opened = self._page.evaluate(_OPEN, list(features))
        except Exception as error:
            self._playwright.stop()
            raise DeviceMissingError(f"Chromium cannot be started: {str(error).splitlines()[0]}") from None
        if opened is None:
            self.close()
            raise DeviceMissingError("this Chromium has no WebGPU adapter")
        self.features, self.limits, self.name = opened
        self.version = self._browser.version
        self._calls: list[list[Any]] = []
        self._dropped: list[int] = []
        self._count = 2

    def call(self, object_: int, name: str, args: list[Any]) -> Remote:
        result, self._count = self._count, self._count + 1
        self._calls.append([object_, camel(name), [plain(one) for one in args], result])
        if len(self._calls) >= _MOST_CALLS:
            self.send()
        return Remote(self, result)

    def drop(self, object_: int) -> None:
        self._dropped.append(object_)

    def send(self) -> None:
        """Make the recorded calls; raises RuntimeError with the first error of them."""
        calls, self._calls, dropped, self._dropped = self._calls, [], self._dropped, []
        if error := self._page.evaluate(_RUN, [calls, dropped]):
            raise RuntimeError(error)

    def read(self, buffer: int, at: int, size: int) -> bytes:
        self.send()
        return base64.b64decode(self._page.evaluate(_READ, [buffer, at, size]))

    def close(self) -> None:
        self._browser.close()
        self._playwright.stop()


class Remote:
    """An object of the page; a call on it is a call there, and gives another."""

    size: int  # of a buffer
    mapped: bytes

    def __init__(self, page: Page, number: int) -> None:
        self.page, self.number = page, number

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *args, **described: self.page.call(
            self.number, name, [*args, *([described] if described else [])]
        )

    def create_buffer(self, *, size: int, usage: int) -> Remote:
        buffer = self.page.call(self.number, "create_buffer", [{"size": size, "usage": usage}])
        buffer.size = size
        return buffer

    def create_shader_module(self, **described: Any) -> Remote:
        made = self.page.call(self.number, "create_shader_module", [described])
        self.page.send()  # an error belongs to this module
        return made

    def map_sync(self, mode: str, at: int, size: int) -> None:
        self.mapped = self.page.read(self.number, at, size)

    def read_mapped(self, at: int, size: int, *, copy: bool) -> bytes:
        return self.mapped

    def __del__(self) -> None:
        if "page" in vars(self):  # else it could not be opened
            self.page.drop(self.number)


class Device(Remote):
    """The device of a page, with the features and limits that it was opened with."""

    def __init__(self, features: tuple[str, ...]) -> None:
        super().__init__(Page(features), 0)
        self.queue = Remote(self.page, 1)
        self.features = set(self.page.features)
        self.limits = {kebab(name): value for name, value in self.page.limits.items()}
        self.name = f"Chromium ({self.page.name.strip()})"
        self.info = DeviceInfo(self.page.name.strip(), "Chromium", self.page.version)
        self.corner_px = SWIFTSHADER_PX if "swiftshader" in self.name.lower() else SNAP_PX

    def destroy(self) -> None:
        self.page.close()


def plain(value: Any) -> Any:
    """Return an argument as playwright sends it."""
    if isinstance(value, Remote):
        return {"$object": value.number}
    if isinstance(value, Mapping):
        return {camel(name): plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    if isinstance(value, (bytes, bytearray, memoryview, np.ndarray)):
        return {"$bytes": base64.b64encode(bytes(value)).decode()}
    return value.item() if isinstance(value, np.generic) else value


def camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(word.capitalize() for word in rest)


def kebab(name: str) -> str:
    """Return a name of a limit as wgpu writes it.

    >>> kebab("maxTextureDimension2D")
    'max-texture-dimension-2d'
    """
    return "".join(
        f"-{c.lower()}" if c.isupper() and i < len(name) - 1 else c.lower() for i, c in enumerate(name)
    ).replace("dimension2d", "dimension-2d")
