"""A view that is used for long: memory, threads and open files of its server do not grow, and its page answers."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import pytest

from tests.conftest import require
from tests.viewer.subjects import KERNEL, files
from tests.viewer.test_page import CHROMIUM, opened, resources, until

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")]
#: Growth of memory that is no leak: MiB in all, and for each round. Allocators keep what they may need again, and pages
#: that pipelines of webgpu have reserved become resident one by one.
MOST_MIB, MOST_MIB_A_ROUND = 8.0, {"numpy": 0.1, "webgpu": 0.7}


class Used:
    """The page of an effect of 8x4 texels, and what a person does there; each ends when the page has answered."""

    def __init__(self, page: Any, effect: Path, dice: random.Random) -> None:
        self.page, self.effect, self.dice = page, effect, dice
        self.factor, self.gain = 1.0, 1.0

    def shows(self) -> None:
        until(self.page, 2, 1, [0, *(min(255, round(byte * self.factor * self.gain)) for byte in (102, 204))])

    def save(self) -> None:
        self.factor = self.dice.uniform(0.2, 1.2)
        self.effect.write_text(KERNEL.replace("* gain", f"* gain * {self.factor}"))
        self.shows()

    def save_a_mistake(self) -> None:
        text = self.effect.read_text()
        self.effect.write_text(text.replace("* gain", f"* gian{self.dice.randrange(99)}"))
        self.page.wait_for_selector("#error:not([hidden])")
        self.effect.write_text(text)
        self.page.wait_for_selector("#error", state="hidden")
        self.shows()

    def move_a_slider(self) -> None:
        self.gain = round(self.dice.uniform(0.2, 1.2), 3)
        self.page.locator("#controls input[type=range]").fill(str(self.gain))
        self.shows()

    def click_a_pixel(self) -> None:
        box = self.page.locator("#picture").bounding_box()
        x, y = self.dice.randrange(8), self.dice.randrange(4)
        self.page.mouse.click(box["x"] + box["width"] * (x + 0.5) / 8, box["y"] + box["height"] * (y + 0.5) / 4)
        self.page.locator("#pixel", has_text=f"({x}, {y})").locator("tbody tr").first.wait_for()
        self.page.locator("#pixel-close").click()

    def drag(self) -> None:
        box = self.page.locator("#stage").bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.page.mouse.move(*middle)
        self.page.mouse.down()
        for _ in range(5):
            self.page.mouse.move(*(at + self.dice.randint(-40, 40) for at in middle))
        self.page.mouse.up()
        self.page.locator("#stage").press("f")

    def compare(self) -> None:
        self.page.locator("#compare").select_option("difference")
        until(self.page, 2, 1, [0, 0, 0])
        self.page.locator("#compare").select_option("")
        self.shows()

    def play(self) -> None:
        self.page.locator("#play").click()
        self.page.wait_for_timeout(200)
        self.page.locator("#play").click()

    def open_again(self) -> None:
        """A page that is opened anew has the default parameters."""
        self.page.reload()
        self.page.wait_for_selector("body[data-shown]")
        self.gain = 1.0
        self.page.locator("#reset").click()
        self.shows()

    def everything(self) -> list[Callable[[], None]]:
        return [
            self.save, self.save, self.save_a_mistake, self.move_a_slider, self.click_a_pixel, self.drag,
            self.compare, self.play, self.open_again,
        ]  # fmt: skip


@pytest.mark.parametrize(("backend", "minutes"), [("numpy", "1"), ("webgpu", "2")])
def test_what_a_server_holds_does_not_grow(tmp_path: Path, backend: str, minutes: str) -> None:
    """Rounds of everything in random order, the first half of them to warm up: webgpu fills its cache of pipelines.

    PASSGRAPH_VIEW_MINUTES makes it longer, PASSGRAPH_VIEW_SEED gives another order.
    """
    require(backend)
    dice = random.Random(int(os.environ.get("PASSGRAPH_VIEW_SEED", "7")))
    effect, picture = files(tmp_path)
    held: list[dict[str, int]] = []
    with opened(str(effect), str(picture), backend=backend) as page:
        used = Used(page, effect, dice)
        end = time.monotonic() + 60.0 * float(os.environ.get("PASSGRAPH_VIEW_MINUTES", minutes))
        while time.monotonic() < end or len(held) < 24:
            actions = used.everything()
            dice.shuffle(actions)
            for act in actions:
                act()
            held.append(resources(page.server_pid))
            print(len(held), held[-1], flush=True)
    rounds = len(held) // 2
    late = held[rounds:]
    part = max(1, len(late) // 4)
    grown = {
        name: median(one[name] for one in late[-part:]) - median(one[name] for one in late[:part]) for name in late[0]
    }
    assert grown["memory"] <= MOST_MIB + MOST_MIB_A_ROUND[backend] * rounds
    assert grown["threads"] <= 1
    assert grown["files"] <= 1
