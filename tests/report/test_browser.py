"""The report in a real browser: every figure is drawn, nothing overflows a telephone's screen, nothing is asked of a network."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from outline import Outline

CHROMIUM = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on this machine (apt-get install chromium)"
)

FRAME = """<!DOCTYPE html><html><body><iframe src="report.html" style="width:{width}px;height:900px;border:0"></iframe>
<script>
const frame = document.querySelector("iframe");
const look = setInterval(function () {{
  const page = frame.contentDocument.documentElement;
  if (page.dataset.figures !== "drawn") return;
  clearInterval(look);
  const plots = [...frame.contentDocument.querySelectorAll(".plot")];
  document.body.dataset.width = page.scrollWidth;
  document.body.dataset.drawn = plots.filter(p => p.classList.contains("js-plotly-plot")).length;
  document.body.dataset.wide = plots.filter(p => p.getBoundingClientRect().right > {width} + 1).length;
  document.body.dataset.covered = plots.filter(function (p) {{
    const legend = p.querySelector("g.legend"), panel = p.querySelector(".cartesianlayer .bglayer, .cartesianlayer .plot");
    return legend && panel && legend.getBoundingClientRect().bottom > panel.getBoundingClientRect().top;
  }}).map(p => p.id).join();
  const choice = frame.contentDocument.querySelector('select[data-figure="figure-7"]');
  choice.value = "Pose 2";
  choice.dispatchEvent(new Event("change"));
  const shown = frame.contentDocument.getElementById("figure-7").data.filter(t => t.visible).map(t => t.meta.pose);
  document.body.dataset.pose = [...new Set(shown)].join();
}}, 100);
</script></body></html>"""


def browse(page: Path, profile: Path, *flags: str) -> str:
    """The document after its scripts have run."""
    assert CHROMIUM is not None
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync", "--allow-file-access-from-files",
        f"--user-data-dir={profile}", "--virtual-time-budget=60000", *flags, "--dump-dom", page.as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=True).stdout


@pytest.mark.parametrize("width", [390, 1400])
def test_figures_are_drawn_and_fit(report: Path, tmp_path: Path, width: int) -> None:
    (tmp_path / "report.html").write_bytes(report.read_bytes())
    (tmp_path / "frame.html").write_text(FRAME.format(width=width), "utf-8")
    dom = browse(tmp_path / "frame.html", tmp_path / "profile", "--window-size=1600,1000")
    found = dict(re.findall(r'data-(width|drawn|wide|pose|covered)="([^"]*)"', dom[dom.index("<body") :]))
    figures = len(Outline(report.read_text("utf-8")).figures())
    assert int(found["drawn"]) == figures
    assert int(found["width"]) <= width
    assert int(found["wide"]) == 0
    assert found["covered"] == ""
    assert found["pose"] == "Pose 2"
