"""Draws docs/live.gif, a short film of a live page, with Chromium; needs Pillow, which matplotlib brings."""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

from chainunit.report.html import render
from chainunit.report.live.page import live_page

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "tests"))
from browser import Page  # noqa: E402

WIDTH, HEIGHT, SHOWN = 1180, 760, 720
MOVED = (("machine.r", 0.375, 0.95), ("feed.left.material_mass", 0.015, 0.25), ("machine.r", 0.95, 0.375))
"""The sliders that move, from one part of their way to another."""
_MOVE = """(async () => {{
  window.liveList = window.liveList ?? (await unpackedData("live-data")).quantities;
  const i = window.liveList.findIndex((q) => q.key.join(".") === "{key}");
  const range = document.querySelector(`input[type=range][data-q="${{i}}"]`);
  range.focus({{ preventScroll: true }});
  range.value = Math.round(400 * {share});
  range.dispatchEvent(new Event("input"));
  const place = document.getElementById("live-place");
  place.value = (Number(place.value) + 5) % 120;
  place.dispatchEvent(new Event("input"));
  await new Promise((go) => requestAnimationFrame(() => setTimeout(go)));
}})()"""


def main() -> None:
    """Write the film."""
    frames = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "live.html"
        file.write_text(render(live_page(None, None, folder)), "utf-8")
        with Page(file, folder / "browser", WIDTH, HEIGHT) as page:
            page.wait("document.getElementById('live-root').dataset.runs")
            page.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
            page.evaluate("document.querySelector('.live-top').scrollIntoView()")
            for key, begin, end in MOVED:
                for k in range(10):
                    page.evaluate(_MOVE.format(key=key, share=begin + (end - begin) * k / 9))
                    shot = folder / "frame.png"
                    page.picture(shot, whole=False)
                    image = Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")
                    frames.append(image.resize((SHOWN, SHOWN * HEIGHT // WIDTH), Image.Resampling.LANCZOS))
    palette = frames[12].quantize(48)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    small[0].save(
        HERE / "live.gif", save_all=True, append_images=small[1:], duration=160, loop=0, optimize=True
    )


if __name__ == "__main__":
    main()
