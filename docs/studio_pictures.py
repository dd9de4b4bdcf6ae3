"""Pictures of the studio for README and docs/studio.md: a guided session in the virtual cell, on the real page.

    python docs/studio_pictures.py

works through the example TX90L in a temporary folder as docs/studio.md does, and writes an animation and three screenshots to
docs/_static/studio. It needs Playwright, Pillow and Debian's Chromium, and takes some minutes.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests" / "studio"), str(ROOT / "tests")]

from browser import ARGUMENTS, studio  # noqa: E402
from headless import CHROMIUM  # noqa: E402

OUT = ROOT / "docs" / "_static" / "studio"
SIZE = (1280, 720)
ANIMATED = (960, 540)
QUALITY, ANIMATED_QUALITY = 80, 70
SHORT, LONG = 1.0, 2.0
"""Seconds that a frame is shown."""
WAIT = 120_000
"""Milliseconds after which something that is waited for is missing."""
FORESEEN = 1200
"""Milliseconds after which it is known what more poses bring, about."""
COURSE = 8000
"""Milliseconds until the predicted errors after fewer poses are worked out."""
SETTLED = 800
"""Milliseconds until the scene is drawn without a graphics card."""


class Walk:
    """A person at a page of the studio, and the frames taken on the way; `keep` is a folder that they are kept in as PNG too."""

    def __init__(self, page: Any, keep: Path | None):
        self.page, self._keep = page, keep
        self._frames: list[Image.Image] = []
        self._times: list[float] = []

    def step(self, name: str) -> None:
        self.page.get_by_role("link", name=name).click(timeout=WAIT)

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).first.click(timeout=WAIT)

    def choose(self, label: str, value: str) -> None:
        self.page.get_by_label(label, exact=True).first.click(timeout=WAIT)
        self.page.get_by_role("option", name=value, exact=True).click(timeout=WAIT)

    def fill(self, label: str, value: str) -> None:
        field = self.page.get_by_label(label, exact=True).first
        field.fill(value)
        field.press("Tab")

    def tab(self, name: str) -> None:
        self.page.get_by_role("tab", name=name).click(timeout=WAIT)

    def pick(self) -> None:
        """Pick the pose with the largest error."""
        self.page.locator("td a[href^='pick/']").first.click(timeout=WAIT)

    def measure(self, number: int) -> None:
        """Measure the next pose, which has this number, and wait for its judgement."""
        self.press("Measure the next pose (N)")
        self.see(re.compile(rf"pose {number} (is|fits|cannot|repeats) "))

    def see(self, text: str | re.Pattern[str]) -> None:
        """Wait for a text."""
        self.page.get_by_text(text).first.wait_for(timeout=WAIT)

    def sees(self, this: str, other: str) -> bool:
        """Wait for a text and for what is foreseen then, and tell whether the other text is there."""
        self.see(this)
        self.page.wait_for_timeout(FORESEEN)
        return self.page.get_by_text(other).count() > 0

    def show(self, text: str) -> None:
        """Scroll to a text."""
        self.page.get_by_text(text).first.scroll_into_view_if_needed(timeout=WAIT)

    def turn(self, right: float, down: float = 0.0, nearer: int = 0) -> None:
        """Turn the scene by dragging it so many pixels, and come nearer by turns of the wheel."""
        mouse, (x, y) = self.page.mouse, (620.0, 260.0)
        mouse.move(x, y)
        mouse.down()
        mouse.move(x + right, y + down, steps=5)
        mouse.up()
        for _ in range(abs(nearer)):
            mouse.wheel(0, -120 if nearer > 0 else 120)
            self.page.wait_for_timeout(100)
        mouse.move(5, 715)

    def take(self, seconds: float = LONG) -> Image.Image:
        """Take a frame of the animation, shown for some seconds, and return the picture."""
        self.page.wait_for_timeout(SETTLED)
        picture = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        self._frames.append(picture.resize(ANIMATED, Image.Resampling.LANCZOS))
        self._times.append(seconds)
        if self._keep is not None:
            picture.save(self._keep / f"{len(self._frames):02}.png")
        return picture

    def close_notice(self, text: str) -> None:
        """Close a notice of viser where it comes, as it does without a graphics card."""
        notice = self.page.locator("[class*=Notification-root]").filter(has_text=text)
        self.page.wait_for_timeout(3000)
        if notice.count():
            notice.get_by_role("button").first.click()
            self.page.wait_for_timeout(500)

    def write(self, path: Path) -> None:
        """Write the animation."""
        first, *others = self._frames
        first.save(
            path,
            save_all=True,
            append_images=others,
            duration=[round(1000 * seconds) for seconds in self._times],
            loop=0,
            quality=ANIMATED_QUALITY,
            method=6,
        )


def guided_session(walk: Walk, url: str) -> dict[str, Image.Image]:
    """The session of docs/studio.md; pictures by the names of their files."""
    walk.page.goto(url)
    walk.see("Begin here")
    walk.close_notice("Software WebGL rendering detected")
    walk.take()
    walk.choose("Example", "Stäubli TX90L, to be measured in the virtual cell")
    walk.press("Copy the example into the folder")
    walk.see("The robot is described")
    walk.take()

    walk.step("2 Plan")
    walk.fill("Number of poses", "20")
    walk.take()
    walk.press("Plan poses")
    walk.see("starting …")
    walk.take(SHORT)
    walk.see("What accuracy is possible?")
    walk.take()
    walk.tab("Accuracy")
    walk.take()

    walk.step("3 Measure")
    walk.see("Next: pose 1")
    walk.choose("Rows come from", "virtual cell")
    walk.take()
    for number in range(1, 13):
        walk.measure(number)
        walk.sees(f"Next: pose {number + 1}", "go on")
        if number in (1, 2, 5, 7, 9, 12):
            walk.take(SHORT)
    walk.press("Measure all that are left")
    walk.see("all 20 planned poses are measured")
    walk.see("pose 20 is")
    walk.page.wait_for_timeout(COURSE)
    walk.take()
    walk.fill("Stop at p90 / mm", "0.06")
    walk.choose("Next pose", "the best anywhere")
    walk.show("3 Measure")
    number = 21
    while not walk.sees(f"Next: pose {number}", "stop: p90 predicted"):
        walk.measure(number)
        if number in (22, 25):
            walk.take(SHORT)
        number += 1
    measure = walk.take()

    walk.step("4 Calibrate")
    walk.see("Calibrate: geometry")
    walk.take()
    walk.press("Calibrate: geometry")
    walk.see("starting …")
    walk.take(SHORT)
    walk.see("open the report")
    walk.take()
    walk.pick()
    walk.turn(120, -20, 3)
    calibrate = walk.take()
    walk.tab("Figures")
    walk.take()
    walk.turn(-120, 20, -3)

    walk.step("2 Plan")
    walk.choose("What to plan", "Poses to verify on")
    walk.press("Draw random poses")
    walk.see("20 random poses, for a verification")
    walk.take(SHORT)
    walk.step("3 Measure")
    walk.choose("Poses", "to verify on")
    walk.see("Next: pose 1")
    walk.press("Measure all that are left")
    walk.see("all 20 planned poses are measured")
    walk.take(SHORT)
    walk.step("5 Verify")
    walk.press("Verify on these poses")
    walk.see("open the report")
    walk.take()
    walk.press("Map")
    walk.press("Compute the map")
    walk.see("calibrated tool's mean error")
    walk.choose("Colours", "before calibration")
    walk.turn(-60, 40, -6)
    walk.take(SHORT)
    walk.choose("Cut along", "y")
    walk.turn(60, -20, 2)
    walk.show("5 Verify")
    map = walk.take()
    walk.choose("Colours", "calibrated, mean")
    walk.show("5 Verify")
    walk.take()
    walk.press("Export")
    walk.press("Export the robot")
    walk.see("open calibrated.urdf")
    walk.take()
    return {"measure": measure, "calibrate": calibrate, "map": map}


def main() -> None:
    """Write the pictures; frames are kept as PNG in a folder that is given as argument."""
    keep = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    with (
        tempfile.TemporaryDirectory() as place,
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS) as browser,
    ):
        folder = Path(place) / "cell"
        folder.mkdir()
        with studio(folder) as running:
            walk = Walk(browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}), keep)
            pictures = guided_session(walk, running.url)
    OUT.mkdir(parents=True, exist_ok=True)
    walk.write(OUT / "walk.webp")
    for name, picture in pictures.items():
        picture.save(OUT / f"{name}.webp", quality=QUALITY, method=6)


if __name__ == "__main__":
    main()
