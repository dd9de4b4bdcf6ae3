"""What is typed fast, or into a page that is late, arrives whole."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from browser import studio
from page_elements import WAIT, go_to

from flexcal import RobotModel

TX90L = Path(__file__).parents[2] / "examples" / "tx90l"

AT_ONCE = """
([labels, values, button]) => {
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const named = (text) => [...document.querySelectorAll("label")].find((one) => one.textContent === text);
  const fields = labels.map((text) => document.getElementById(named(text).htmlFor));
  const shown = [...document.querySelectorAll("button")].find((one) => one.textContent === button);
  fields.forEach((field, k) => {
    set.call(field, values[k]);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
  shown?.click();
}
"""
"""Types numbers into fields and presses a button in one task of the browser, as a busy page works through what has piled up."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf"):
        shutil.copy(TX90L / name, folder / name)
    return folder


def test_all_that_is_typed_arrives(page: Any, project: Path) -> None:
    """Coordinates before the button that writes them; numbers of a plan in its command line, an emptied one as it is shown again."""
    with studio(project) as running:
        page.goto(running.url)
        page.get_by_label("x / mm").fill("1", timeout=WAIT)
        page.get_by_role("button", name="Write to robot.yaml", exact=True).wait_for(timeout=WAIT)
        labels = [f"{axis} / mm" for axis in "xyz"]
        page.evaluate(AT_ONCE, [labels, ["12.5", "-34.5", "56.5"], "Write to robot.yaml"])
        page.get_by_role("button", name="Take the last change back").wait_for(timeout=WAIT)
        place = RobotModel.from_yaml(project / "robot.yaml").config.points["smr"].xyz
        assert tuple(place) == pytest.approx((0.0125, -0.0345, 0.0565))

        go_to(page, "Plan")
        page.get_by_text("More", exact=True).click(timeout=WAIT)
        candidates = page.get_by_label("Random candidates")
        candidates.fill("500", timeout=WAIT)
        labels = ["Number of poses", "Random candidates", "Seed"]
        page.evaluate(AT_ONCE, [labels, ["12", "900", "7"], ""])
        page.get_by_text("--count 12 --candidates 900 --seed 7").first.wait_for(timeout=WAIT)
        candidates.fill("")
        page.get_by_label("Seed").fill("8")
        page.get_by_text("--count 12 --candidates 900 --seed 8").first.wait_for(timeout=WAIT)
        assert candidates.input_value() == "900"
