"""The report in a real browser: every figure is drawn, nothing overflows a telephone's screen, and axe finds no barrier."""

from __future__ import annotations

import html
import json
import re
import subprocess
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from headless import CHROMIUM
from outline import Outline
from program_results import program_results
from waiting import PATIENCE

from flexcal.model.robot import RobotModel
from flexcal.report.layout.rendering import page_html
from flexcal.report.pages import ProgramStudy, program_page

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on this machine (apt-get install chromium)"
)

FRAME = """<!DOCTYPE html><html><body><iframe src="report.html" style="width:{width}px;height:900px;border:0"></iframe>
<script>
const frame = document.querySelector("iframe");
const look = setInterval(async function () {{
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
  {more}
  for (const folded of frame.contentDocument.querySelectorAll("details")) folded.open = true;
  // lines and marks without text, name or role are nothing that axe judges, and nine tenths of what it would go through
  const silent = ".plot svg :not(:has(text), text, text *, title, [role], [tabindex], [aria-label])";
  for (const drawn of frame.contentDocument.querySelectorAll(silent)) drawn.remove();
  frame.contentWindow.eval(await (await fetch("axe.js")).text());
  const found = await frame.contentWindow.axe.run(frame.contentDocument, {{ resultTypes: ["violations"] }});
  document.body.dataset.violations = JSON.stringify(
    found.violations.map(v => [v.id, v.impact, v.nodes.map(n => n.target.join(" ")).slice(0, 3)]));
  document.body.dataset.dark = frame.contentWindow.matchMedia("(prefers-color-scheme: dark)").matches;
  document.body.dataset.rules = found.passes.length;
}}, 100);
</script></body></html>"""


OF_DEMO = """const choice = frame.contentDocument.querySelector('select[data-figure="figure-7"]');
  choice.value = "Pose 2";
  choice.dispatchEvent(new Event("change"));
  const shown = frame.contentDocument.getElementById("figure-7").data.filter(t => t.visible).map(t => t.meta.pose);
  document.body.dataset.pose = [...new Set(shown)].join();
  const slider = frame.contentDocument.querySelector('input[data-figure="figure-10"]');
  const cones = () => frame.contentDocument.getElementById("figure-10").data.find(t => t.type === "cone" && t.visible);
  const longest = () => Math.max(...["u", "v", "w"].flatMap(k => [...cones()[k]]).map(Math.abs));
  const before = longest();
  slider.value = Number(slider.value) + 3;
  slider.dispatchEvent(new Event("input"));
  document.body.dataset.stretched = longest() / before;
  document.body.dataset.said = slider.getAttribute("aria-valuetext");
  const canvas = frame.contentDocument.querySelector("#figure-10 canvas");
  const caught = [false, true].map(function (ctrlKey) {
    const wheel = new frame.contentWindow.WheelEvent("wheel", { deltaY: 40, ctrlKey, bubbles: true, cancelable: true });
    canvas.dispatchEvent(wheel);
    return wheel.defaultPrevented;
  });
  document.body.dataset.caught = caught.join();"""
"""What only the demo's page has: poses to choose from, arrows to stretch, and a scene that lets the page scroll."""


def browse(page: Path, profile: Path, *flags: str) -> str:
    """The document after its scripts have run."""
    assert CHROMIUM is not None
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync", "--allow-file-access-from-files",
        f"--user-data-dir={profile}", "--virtual-time-budget=10000", *flags, "--dump-dom", page.as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True).stdout


def seen(page: str, folder: Path, width: int, scheme: str, more: str = "") -> dict[str, str]:
    """What the frame around the page found, by `more` besides; no barrier, nothing that overflows, every figure."""
    axe = pytest.importorskip("axe_core_python")
    (folder / "axe.js").write_bytes(files(axe).joinpath("axe.min.js").read_bytes())
    (folder / "report.html").write_bytes(page.encode())
    (folder / "frame.html").write_text(FRAME.format(width=width, more=more), "utf-8")
    preferred = f"--blink-settings=preferredColorScheme={0 if scheme == 'dark' else 1}"
    dom = browse(folder / "frame.html", folder / "profile", "--window-size=1600,1000", preferred)
    body = dom[dom.index("<body") : dom.index(">", dom.index("<body"))]
    found = {key: html.unescape(value) for key, value in re.findall(r'data-(\w+)="([^"]*)"', body)}
    figures = len(Outline(page).figures())
    assert int(found["drawn"]) == figures
    assert int(found["width"]) <= width
    assert int(found["wide"]) == 0
    assert found["covered"] == ""
    assert found["dark"] == str(scheme == "dark").lower() and int(found["rules"]) > 20
    barriers = [v for v in json.loads(found["violations"]) if v[1] in ("serious", "critical")]
    assert barriers == []
    return found


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1400, "dark")])
def test_figures_are_drawn_and_fit_and_nobody_is_shut_out(
    report: Path, tmp_path: Path, width: int, scheme: str
) -> None:
    found = seen(report.read_text("utf-8"), tmp_path, width, scheme, OF_DEMO)
    assert found["pose"] == "Pose 2"
    assert float(found["stretched"]) == pytest.approx(10, rel=1e-5) and found["said"].endswith("0 times")
    assert found["caught"] == "false,true"


def test_a_long_name_of_a_recording_fits_a_telephone(payload_folder: Path, tmp_path: Path) -> None:
    page = (payload_folder / "report.html").read_text("utf-8")
    seen(page.replace("loaded.csv", f"{'loaded_' * 9}.csv"), tmp_path, 390, "light")


def test_the_page_of_a_program_fits_a_telephone_with_names_that_look_like_markup(
    tx90l: RobotModel, tmp_path: Path
) -> None:
    study = ProgramStudy(tx90l, program_results(), np.zeros(6))
    more = "document.body.dataset.tables = frame.contentDocument.querySelectorAll('table').length;"
    found = seen(page_html(program_page(study)), tmp_path, 390, "light", more)
    assert found["tables"] == "2"


WITHOUT_WEBGL = """<!DOCTYPE html><html><body><iframe src="report.html" style="width:500px;height:900px;border:0"></iframe>
<script>
const frame = document.querySelector("iframe");
const look = setInterval(function () {
  const page = frame.contentDocument.documentElement;
  if (page.dataset.figures !== "drawn") return;
  clearInterval(look);
  const flat = [...frame.contentDocument.querySelectorAll("canvas.flat")];
  const inked = flat.filter(function (canvas) {
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let seen = 0;
    for (let k = 3; k < data.length; k += 4) seen += data[k] > 0;
    return seen > 0.005 * data.length / 4;
  });
  document.body.dataset.flat = flat.map(canvas => canvas.parentElement.id).join();
  document.body.dataset.inked = inked.length;
  document.body.dataset.cut = [...frame.contentDocument.querySelectorAll(".scroll")].filter(
    r => r.clientWidth && r.scrollWidth > r.clientWidth + 1 && !r.nextElementSibling.classList.contains("sideways")).length;
  document.body.dataset.hints = frame.contentDocument.querySelectorAll(".sideways").length;
}, 100);
</script></body></html>"""


def test_figures_in_space_are_drawn_flat_without_webgl_and_cut_tables_say_so(
    report: Path, tmp_path: Path
) -> None:
    page = report.read_text("utf-8")
    (tmp_path / "report.html").write_text(page, "utf-8")
    (tmp_path / "frame.html").write_text(WITHOUT_WEBGL, "utf-8")
    dom = browse(
        tmp_path / "frame.html", tmp_path / "profile", "--disable-3d-apis", "--window-size=1600,1000"
    )
    body = dom[dom.index("<body") : dom.index(">", dom.index("<body"))]
    found = dict(re.findall(r'data-(\w+)="([^"]*)"', body))
    spaces = [
        text for text in re.findall(r'data-specification="[^"]*">(.*?)</script>', page) if '"scene":' in text
    ]
    assert len(found["flat"].split(",")) == len(spaces) == int(found["inked"]) > 1
    assert found["cut"] == "0" and int(found["hints"]) > 0
