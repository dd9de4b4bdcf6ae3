"""The box of the working volume, dragged in the scene."""

from __future__ import annotations

import io
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import studio
from page_elements import WAIT, go_to, see

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"
ALONG_X = (255, 32, 96)
"""Colour of a handle's arrow along x."""


def arrow_of_the_largest_corner(page: Any) -> tuple[float, float]:
    """Place on the page of the middle of the right one of the two arrows along x."""
    image = pytest.importorskip("PIL.Image", reason="Pillow is absent")
    picture = np.array(image.open(io.BytesIO(page.screenshot())).convert("RGB"), dtype=int)
    rows, columns = np.nonzero(np.abs(picture - ALONG_X).sum(axis=2) < 60)
    right = columns > columns.mean()
    return float(np.median(columns[right])), float(np.median(rows[right]))


def test_a_dragged_corner_is_in_the_fields_and_in_the_command(page: Any, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "arm"
    shutil.copytree(EXAMPLE, folder)
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Plan")
        page.get_by_label("Working volume").last.click(timeout=WAIT)
        page.get_by_role("option", name="a box").click()
        see(page, "--working=0.651:1.303,-0.558:0.558,0.372:1.116")
        page.wait_for_timeout(1500)  # until both handles are drawn
        across, down = arrow_of_the_largest_corner(page)
        page.mouse.move(across, down)
        page.mouse.down()
        for step in range(1, 9):
            page.mouse.move(across - 10 * step, down - 2 * step)
        page.mouse.up()
        page.get_by_text(re.compile(r"--working=0\.651:(?!1\.303)")).first.wait_for(timeout=WAIT)
        page.wait_for_timeout(500)
        line = page.get_by_text(re.compile("--working=")).first.inner_text()
    low, high = json.loads((folder / ".studio.json").read_text())["plan.box"]
    assert low == [0.651, -0.558, 0.372] and high[1:] == [0.558, 1.116]
    assert 0.7 < high[0] < 1.25  # towards the robot, as the mouse
    assert f"--working=0.651:{high[0]:g},-0.558:0.558,0.372:1.116" in "".join(line.split("\n"))
