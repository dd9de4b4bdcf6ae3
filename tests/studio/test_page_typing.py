"""What is half typed stays, whatever happens to the page meanwhile, and no key that is typed is taken for a hot key."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Running, studio
from page_elements import WAIT, count_rows, field, go_to, press, see

from flexcal import PosePlan, RobotModel, VirtualCell
from flexcal.data.plans import write_plan
from flexcal.files.formats import read_yaml
from flexcal.virtual_cell import CellConfig

TX90L = Path(__file__).parents[2] / "examples" / "tx90l"
COUNT = 6

AT_ONCE = """
([label, texts, key]) => {
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const shown = [...document.querySelectorAll("label")].find((one) => one.textContent === label);
  const field = document.evaluate("following::input[1]", shown, null, XPathResult.FIRST_ORDERED_NODE_TYPE).singleNodeValue;
  for (const text of texts) {
    set.call(field, text);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }
  document.body.dispatchEvent(new KeyboardEvent("keydown", { key, code: `Key${key.toUpperCase()}`, bubbles: true }));
}
"""
"""Types texts into a field, one after the other, and presses a hot key, in one task of the browser."""


@pytest.fixture
def running(tmp_path: Path) -> Iterator[tuple[Running, Path, PosePlan]]:
    """A studio on the example with a plan of random poses, of which one is measured."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        shutil.copy(TX90L / name, folder / name)
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    plan = PosePlan(q=np.random.default_rng(3).uniform(-0.5, 0.5, (COUNT, model.n)))
    write_plan(folder / "poses.yaml", plan)
    cell, _ = VirtualCell.drawn(model, read_yaml(TX90L / "cell.yaml", CellConfig), 1)
    measured = cell.measure(plan)
    lines = ["pose,q1,q2,q3,q4,q5,q6,x,y,z"]
    for k in range(COUNT):
        numbers = (*measured.q[k].tolist(), *measured.position[k].tolist())
        lines.append(",".join([str(k + 1), *(repr(value) for value in numbers)]))
    (folder / "poses.csv").write_text("\n".join(lines[:2]) + "\n")
    (tmp_path / "row").write_text(lines[2] + "\n")
    (folder / ".studio.json").write_text(json.dumps({"step": "Measure"}))
    with studio(folder) as process:
        yield process, folder, plan


def excluded(folder: Path) -> str:
    rows = list(csv.DictReader((folder / "poses.csv").read_text().splitlines()))
    return rows[-1].get("excluded", "")


def test_what_is_half_typed_stays(page: Any, running: Any, browser: Any, tmp_path: Path) -> None:
    """Dark and light, another size, a row that comes, a second window that opens another step and comes back, a reload."""
    process, folder, _ = running
    page.goto(process.url)
    see(page, "Next: pose 2")
    fields = [page.get_by_label(f"{axis} / mm") for axis in "xyz"]
    fields[0].fill("534.8619")
    fields[1].fill("-5")
    reason = field(page, "Reason")
    reason.fill("the target sh")

    def stays() -> None:
        page.wait_for_timeout(400)
        assert [one.input_value(timeout=WAIT) for one in fields] == ["534.8619", "-5", ""]
        assert reason.input_value() == "the target sh"

    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("d")
    page.wait_for_function("document.documentElement.dataset.mantineColorScheme === 'dark'", timeout=WAIT)
    stays()
    page.set_viewport_size({"width": 500, "height": 900})
    stays()
    page.set_viewport_size({"width": 1024, "height": 768})
    stays()
    other = browser.new_context().new_page()
    other.goto(process.url)
    go_to(other, "Plan")
    page.locator("nav [aria-current=step]", has_text="Plan").wait_for(timeout=WAIT)
    go_to(other, "Measure")
    see(page, "Next: pose 2")
    stays()
    other.context.close()
    page.reload()
    see(page, "Next: pose 2")
    stays()
    with (folder / "poses.csv").open("a") as stream:
        stream.write((tmp_path / "row").read_text())
    see(page, "Next: pose 3")
    stays()
    fields[1].fill("-572.7086")
    fields[2].fill("901.3214")
    press(page, "Take this point (Enter)")
    see(page, "the next pose has become pose 3 since this point was begun")
    assert [one.input_value() for one in fields] == ["534.8619", "-572.7086", "901.3214"]
    press(page, "Take this point (Enter)")
    see(page, "Next: pose 4")
    page.wait_for_function("document.querySelector('form:not([data-sent])')")
    assert [one.input_value() for one in fields] == [""] * 3
    page.reload()
    see(page, "Next: pose 4")
    assert [one.input_value(timeout=WAIT) for one in fields] == [""] * 3
    assert count_rows(folder / "poses.csv") == 3


def test_a_place_that_is_not_written_yet_stays(page: Any, running: Any) -> None:
    """After another step it is in its fields again, as not written."""
    process, folder, _ = running
    before = (folder / "robot.yaml").read_bytes()
    page.goto(process.url)
    go_to(page, "Robot")
    page.get_by_label("y / mm").fill("-34.5", timeout=WAIT)
    see(page, "not written yet")
    page.keyboard.press("Escape")
    go_to(page, "Plan")
    go_to(page, "Robot")
    see(page, "not written yet")
    assert float(page.get_by_label("y / mm").input_value()) == -34.5
    assert (folder / "robot.yaml").read_bytes() == before
    press(page, "Keep what robot.yaml has")
    see(page, "As in robot.yaml")
    assert float(page.get_by_label("y / mm").input_value()) != -34.5


def test_keys_and_hot_keys(page: Any, running: Any) -> None:
    """A hot key comes after what was typed before it; keys in a field, or while a point is sent, are no hot keys."""
    process, folder, _ = running
    page.goto(process.url)
    see(page, "Next: pose 2")
    page.evaluate(AT_ONCE, ["Reason", ["t", "the target", "the target shook"], "x"])
    see(page, "is excluded: the target shook")
    assert excluded(folder) == "the target shook"
    page.evaluate(AT_ONCE, ["Reason", [""], "x"])
    see(page, "is used again")

    reached = "window.reached = []; document.addEventListener('keydown', (event) => window.reached.push(event.code))"
    page.evaluate(reached)  # where the camera listens
    for key in ("d", "d", "w", "ArrowUp"):
        page.keyboard.press(key)
    assert page.evaluate("window.reached") == ["ArrowUp"]

    for label in ("Reason", "x / mm"):
        place = page.get_by_label(label) if "mm" in label else field(page, label)
        place.click()
        page.keyboard.type("dunx12345s6")
        page.wait_for_timeout(300)
        assert place.input_value() == "dunx12345s6"
        place.fill("")
    assert page.locator("nav [aria-current=step]").inner_text().endswith("Measure")
    assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == "light"
    assert count_rows(folder / "poses.csv") == 1
    assert not excluded(folder)

    page.route("**/enter/*", lambda route: (page.wait_for_timeout(400), route.continue_()))
    for axis, text in zip("xyz", ("534.8619", "-572.7086", "901.3214"), strict=True):
        page.get_by_label(f"{axis} / mm").fill(text)
    page.keyboard.press("Enter")
    page.keyboard.type("1")
    see(page, "Next: pose 3")
    page.wait_for_function("document.querySelector('form:not([data-sent])')")
    assert page.locator("nav [aria-current=step]").inner_text().endswith("Measure")
    assert count_rows(folder / "poses.csv") == 2


def test_temperature_of_the_arm(page: Any, running: Any) -> None:
    """Asked for where robot.yaml has terms of temperature; a number of °C that an arm can have, in every row."""
    process, folder, _ = running
    (folder / "poses.csv").unlink()
    robot = folder / "robot.yaml"
    robot.write_text(robot.read_text().replace("terms: auto", "terms: [kinematic, thermal]"))
    page.goto(process.url)
    see(page, "Next: pose 1")
    warm = page.get_by_label("arm / °C", exact=True)
    warm.wait_for(timeout=WAIT)
    for text, told in (
        ("", "arm / °C is empty"),
        ("warm", "arm / °C: 'warm' is not a number"),
        ("295", "arm / °C"),
    ):
        for axis, typed in zip("xyz", ("534.8619", "-572.7086", "901.3214"), strict=True):
            page.get_by_label(f"{axis} / mm").fill(typed)
        warm.fill(text)
        press(page, "Take this point (Enter)")
        page.get_by_role("alert").filter(has_text=told).wait_for(timeout=WAIT)
        assert count_rows(folder / "poses.csv") == 0
    warm.fill("23.4")
    warm.press("Enter")
    see(page, "Next: pose 2")
    page.wait_for_function("document.querySelector('form:not([data-sent])')")
    for label, typed in zip(("x / mm", "y / mm", "z / mm", "arm / °C"), ("1", "2", "3", "-4.5"), strict=True):
        page.get_by_label(label, exact=True).fill(typed)
    warm.press("Enter")
    see(page, "Next: pose 3")
    rows = list(csv.DictReader((folder / "poses.csv").read_text().splitlines()))
    assert [float(row["temperature"]) for row in rows] == [23.4, -4.5]
    press(page, "Undo (U)")
    press(page, "Undo (U)")
    see(page, "Next: pose 1")
    page.get_by_label("Arm / °C too").click(timeout=WAIT)
    warm.wait_for(state="detached", timeout=WAIT)
