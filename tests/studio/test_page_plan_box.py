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
from waiting import until

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"
ALONG_X = (255, 32, 96)
"""Colour of a handle's arrow along x."""
APART = 100
"""Pixels between the arrows of two handles, at least; an arrow is shorter."""


def arrow_of_the_largest_corner(page: Any) -> tuple[float, float]:
    """Place on the page of the middle of the right one of the two arrows along x, once nothing moves any more."""
    image = pytest.importorskip("PIL.Image", reason="Pillow is absent")
    before = np.zeros(())
    while True:
        picture = np.array(image.open(io.BytesIO(page.screenshot())).convert("RGB"), dtype=int)
        rows, columns = np.nonzero(np.abs(picture - ALONG_X).sum(axis=2) < 60)
        there = np.stack([rows, columns])
        if columns.size and np.ptp(columns) > APART and np.array_equal(there, before):
            break
        before = there
        page.wait_for_timeout(500)
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
        across, down = arrow_of_the_largest_corner(page)
        page.mouse.move(across, down)
        page.mouse.down()
        for step in range(1, 9):
            page.mouse.move(across - 10 * step, down - 2 * step)
        page.mouse.up()
        page.get_by_text(re.compile(r"--working=0\.651:(?!1\.303)")).first.wait_for(timeout=WAIT)

        def box() -> list[list[float]]:
            return json.loads((folder / ".studio.json").read_text())["plan.box"]

        def is_in_the_command() -> bool:
            line = page.get_by_text(re.compile("--working=")).first.inner_text()
            return f"--working=0.651:{box()[1][0]:g},-0.558:0.558,0.372:1.116" in "".join(line.split("\n"))

        until(is_in_the_command)
        low, high = box()
    assert low == [0.651, -0.558, 0.372] and high[1:] == [0.558, 1.116]
    assert 0.7 < high[0] < 1.25  # towards the robot, as the mouse
