"""The page of the robot, as a person uses it: from an empty folder to a robot.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from page_elements import WAIT

from flexcal.model.robot import RobotModel
from flexcal.studio.steps.robot.uploads import LARGEST

EXAMPLES = Path(__file__).parents[2] / "examples"


def upload(page: Any, name: str, content: bytes) -> None:
    """Choose a file with the page's button."""
    page.locator('input[type="file"]').first.set_input_files(
        {"name": name, "mimeType": "application/octet-stream", "buffer": content}
    )


def test_from_an_empty_folder_to_a_robot(page: Any, studio_url: str, tmp_path: Path) -> None:
    """A bad file is refused, a good one taken; robot.yaml is made, broken, mended, and a point moved in it."""
    folder = tmp_path / "project"
    page.goto(studio_url)
    page.get_by_text("Begin here:").wait_for(timeout=WAIT)

    upload(page, "arm.urdf", b"\x89PNG")
    page.get_by_text("arm.urdf: this is no XML").wait_for(timeout=WAIT)
    upload(page, "empty.urdf", b"")
    page.get_by_text("empty.urdf is empty").wait_for(timeout=WAIT)
    large = tmp_path / "large.urdf"
    with large.open("wb") as stream:
        stream.truncate(LARGEST + 1_000_000)
    page.locator('input[type="file"]').first.set_input_files(large)
    page.get_by_text("large.urdf has 51 MB").wait_for(timeout=WAIT)
    assert [p.name for p in folder.iterdir() if not p.name.startswith(".studio.")] == []

    urdf = (EXAMPLES / "ur5_tracker" / "ur5.urdf").read_bytes()
    upload(page, "ur5.urdf", urdf)
    page.get_by_text("Look at the robot").wait_for(timeout=WAIT)
    assert (folder / "ur5.urdf").read_bytes() == urdf
    page.get_by_text("shoulder_pan_joint").first.wait_for(timeout=WAIT)

    page.get_by_role("button", name="Create robot.yaml").click()
    page.get_by_text("Place smr where it is on the tool").wait_for(timeout=WAIT)
    robot_file = folder / "robot.yaml"
    made = robot_file.read_text()

    robot_file.write_text(made.replace("xyz: [0.0, 0.0, 0.0]", "xyz: [0.0, 0.0]"))
    line = 1 + next(i for i, text in enumerate(made.splitlines()) if text.startswith("  smr:"))
    page.get_by_text(f"robot.yaml, line {line}, column").wait_for(timeout=WAIT)
    robot_file.write_text(made)
    page.get_by_text("Place smr where it is on the tool").wait_for(timeout=WAIT)

    z = page.get_by_label("z / mm")
    z.fill("31")
    z.press("Tab")
    page.get_by_text("not written yet: (0, 0, 0) → (0, 0, 31) mm").wait_for(timeout=WAIT)
    assert robot_file.read_text() == made
    page.get_by_role("button", name="Write to robot.yaml", exact=True).click()
    page.get_by_text("The robot is described, with 1 measured point.").wait_for(timeout=WAIT)
    assert robot_file.read_text() == made.replace("xyz: [0.0, 0.0, 0.0]", "xyz: [0.0, 0.0, 0.031]")
    assert RobotModel.from_yaml(robot_file).config.points["smr"].xyz == (0.0, 0.0, 0.031)
    page.get_by_role("button", name="Take the last change back").click()
    page.get_by_text("Place smr where it is on the tool").wait_for(timeout=WAIT)
    assert robot_file.read_text() == made
