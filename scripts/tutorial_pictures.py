#!/usr/bin/env python3
"""Make the pictures of the tutorials and of the README: run their pages, and photograph what they have made in a headless Chromium.

    scripts/tutorial_pictures.py [NAME …]      writes docs/images/NAME; all of them without a name

Needs the packages ksl[all], playwright, duckdb, pandas, pillow and example-robot-data, and Chromium."""

import io
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
CHROMIUM = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
LARGEST = 150_000  # bytes of a picture


@dataclass(frozen=True)
class Picture:
    """What a page of the tutorials has made, as a browser shows it."""

    page: str
    """The tutorial that makes the file."""
    file: str
    """HTML file in the folder of the tutorial."""
    size: tuple[int, int]
    """Of the window, in pixels."""
    prepare: Callable = lambda page: None
    """Done with the page before it is photographed: scrolls, for example."""


def top_at(selector: str, offset: int = 12) -> Callable:
    """Scrolls an element of the page to its top."""

    def scroll(page) -> None:
        page.locator(selector).first.evaluate("(e, offset) => window.scrollTo(0, e.getBoundingClientRect().top + window.scrollY - offset)", offset)

    return scroll


def at_time(seconds: float, closer: int = 0) -> Callable:
    """Stops the playback of an exported scene at a time, and goes closer by some steps of the mouse's wheel."""

    def stop(page) -> None:
        page.locator(".mantine-Notification-closeButton").first.click()  # the browser here has no graphics card, and says so
        page.locator("button.mantine-ActionIcon-root").first.click()
        page.locator("input.mantine-NumberInput-input").fill(f"{seconds:g}")
        page.keyboard.press("Enter")
        page.mouse.move(page.viewport_size["width"] / 2, page.viewport_size["height"] / 2)
        for _ in range(closer):
            page.mouse.wheel(0, -100)

    return stop


PICTURES = {
    "tutorial_repair.png": Picture("repair", "arm.html", (900, 560), at_time(3.6)),
    "tutorial_smooth.png": Picture(
        "measured_motion",
        "loads/report.html",
        (700, 390),
        top_at("section:has(h2:text-is('panda_joint2')) figure:has(figcaption:has-text('raw and smoothed'))"),
    ),
    "tutorial_report.png": Picture("size_a_joint", "signed/report.html", (1060, 700)),
    "tutorial_joint.png": Picture("size_a_joint", "signed/report.html", (1060, 530), top_at("section:has(h2:text-is('panda_joint2'))")),
    "tutorial_payload.png": Picture("worst_payload", "payload.html", (900, 480)),
    "tutorial_viewer.png": Picture("viewer", "with_hand.html", (960, 580), at_time(3.25, 1)),
    "tutorial_notebook.png": Picture("notebook", "joint1.html", (900, 450)),
}


def photograph(browser, url: str, picture: Picture) -> bytes:
    """PNG of the page, in 256 colours if it would be too large otherwise."""
    from PIL import Image

    width, height = picture.size
    page = browser.new_page(viewport={"width": width, "height": height})
    page.goto(url)
    page.wait_for_timeout(4000)  # pictures of the mechanism are drawn after the page is loaded
    picture.prepare(page)
    page.wait_for_timeout(1500)
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    page.close()
    for made in (shot, shot.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)):
        out = io.BytesIO()
        made.save(out, "PNG", optimize=True)
        if out.tell() <= LARGEST:
            break
    return out.getvalue()


def main(names: list[str]) -> None:
    from playwright.sync_api import sync_playwright

    sys.path.insert(0, str(ROOT / "test" / "contract"))
    from pages import TUTORIALS, Walk

    chosen = {name: PICTURES[name] for name in names or PICTURES}
    with sync_playwright() as api, tempfile.TemporaryDirectory() as folder:
        browser = api.chromium.launch(executable_path=shutil.which("chromium") or shutil.which("google-chrome"), args=CHROMIUM)
        walks = {}
        for name, picture in chosen.items():
            if picture.page not in walks:
                walk = walks[picture.page] = Walk(TUTORIALS / f"{picture.page}.md", Path(folder) / picture.page)
                walk.until(len(walk.blocks) - 1)
                walk.close()
            png = photograph(browser, (walks[picture.page].folder / picture.file).as_uri(), picture)
            if len(png) > LARGEST:
                sys.exit(f"{name}: {len(png)} bytes, more than {LARGEST}; make the window smaller")
            (IMAGES / name).write_bytes(png)
            print(f"{name}: {len(png) // 1000} kB")
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
