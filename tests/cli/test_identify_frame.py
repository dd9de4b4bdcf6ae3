"""`identify frame`: the frame of a work object from touches, on arms of strangers, exact and with joints that are off."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal, refused
from stranger_arm import SIX, StrangerArm, rigid, rodrigues, turn
from test_distances import points, reached

from flexcal import RobotModel, calibrate, read_poses, rigid_motion
from flexcal.data.poses import read_frame_touches
from flexcal.jobs.frame import FrameIdentification, identify_work_object
from flexcal.model.kinematics import point_kinematics

PLACE = rigid(turn(np.array([0.15, -0.1, 0.6])), np.array([0.62, -0.12, 0.42]))
"""The work object in the base frame of the true arm."""
HOLES = {
    "A": (0.0, 0.0, 0.0),
    "B": (0.3, 0.0, 0.0),
    "C": (0.28, 0.2, 0.0),
    "D": (0.02, 0.22, 0.05),
    "E": (0.12, 0.1, -0.03),
}
THREE = ("A", "B", "D")
BLOCK = {
    "1": [(0.02, 0.03, 0.0), (0.25, 0.02, 0.0), (0.24, 0.18, 0.0), (0.05, 0.17, 0.0)],
    "2": [(0.03, 0.0, -0.02), (0.28, 0.0, -0.03), (0.15, 0.0, -0.01)],
    "3": [(0.0, 0.05, -0.02), (0.0, 0.15, -0.02)],
}
"""Touches of a block, whose inside is at positive x and y."""


def own_base(arm: StrangerArm) -> np.ndarray:
    """The base frame as the arm has it: where its first axis really lies, and from its own zero."""
    axis, nominal = arm.true_direction[0], arm.direction[0]
    tilt = (
        rodrigues(np.cross(nominal, axis), float(np.arcsin(np.linalg.norm(np.cross(nominal, axis)))))
        if arm.size
        else np.eye(3)
    )
    off = arm.true_origin[0] - tilt @ arm.origin[0]
    tilted = rigid(tilt, off - axis * (axis @ off))
    about = rodrigues(axis, arm.zeros[0])
    return rigid(about, arm.true_origin[0] - about @ arm.true_origin[0]) @ tilted


def touched(
    arm: StrangerArm,
    path: Path,
    places: list[tuple[str, tuple[float, ...]]],
    rng: np.random.Generator,
    *,
    noise: float = 0.0,
    columns: str = "point,wx,wy,wz",
    place: np.ndarray = PLACE,
    tool_turns: float = 0.0,
) -> Path:
    """Poses at which the true tip is at places (m) of the work object, with the noise."""
    start = reached(arm, lambda p: p - place[:3, 3], arm.postures(1, np.random.default_rng(1))[0])
    assert start is not None
    rows = [f"q1,q2,q3,q4,q5,q6,{columns}"]
    for name, w in places:
        at = place[:3, :3] @ np.array(w) + place[:3, 3] + noise * rng.normal(size=3)
        q = None
        while q is None:
            q = reached(
                arm, lambda p, at=at: p - at, start + tool_turns * rng.uniform(-1, 1, 6) * [0, 0, 0, 1, 1, 1]
            )
        told = [name] + [repr(v) for v in w] if "wx" in columns else [name]
        rows.append(",".join([*map(repr, q.tolist()), *told]))
    path.write_text("\n".join(rows) + "\n")
    return path


def off(
    arm: StrangerArm, found: FrameIdentification, place: np.ndarray = PLACE
) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the origin (base axes) and of the rotation (work object's axes) in the arm's own base frame."""
    truth = np.linalg.inv(own_base(arm)) @ place
    between = truth[:3, :3].T @ found.rotation
    turned = (
        np.array(
            [between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]]
        )
        / 2
    )
    return found.origin - truth[:3, 3], turned


def named(names=tuple(HOLES), times: int = 1) -> list[tuple[str, tuple[float, ...]]]:
    return [(name, HOLES[name]) for name in names] * times


def faces(of: dict, times: int = 1) -> list[tuple[str, tuple[float, ...]]]:
    return [(name, w) for name, places in of.items() for w in places] * times


def exact(folder: Path) -> tuple[StrangerArm, RobotModel, Path]:
    arm = StrangerArm(2, axes=tuple(SIX), size=0.0, point_error=(0, 0, 0))
    robot = arm.write(folder)
    return arm, RobotModel.from_yaml(robot), robot


def test_an_exact_arm_finds_the_work_object_in_every_way(tmp_path: Path) -> None:
    arm, model, _ = exact(tmp_path)
    rng = np.random.default_rng(3)
    axis_points = [("origin", (0.0, 0, 0)), ("x", (0.25, 0.0, 0.0)), ("xy", (0.1, 0.2, 0.0))]
    axes = [("x1", (0.1, 0.0, 0.0)), ("x2", (0.3, 0.0, 0.0)), ("y1", (0.0, 0.2, 0.0))]
    for number, (places, columns) in enumerate(
        [
            (named(), "point,wx,wy,wz"),
            (named(THREE), "point,wx,wy,wz"),
            (faces(BLOCK), "face"),
            (axis_points, "point"),
            (axes * 2, "point"),
        ]
    ):
        file = touched(arm, tmp_path / f"{number}.csv", places, rng, columns=columns)
        found = identify_work_object(model, read_frame_touches(file, model))
        origin, angle = off(arm, found)
        assert np.abs(origin).max() < 2e-6, columns
        assert np.abs(angle).max() < 2e-5, columns
        assert found.fit.from_tool


def test_the_command_line_gives_what_controllers_take(tmp_path: Path, run) -> None:
    arm, _, robot = exact(tmp_path)
    place = rigid(rodrigues(np.array([0, 0, 1.0]), np.pi / 2), np.array([0.65, -0.1, 0.4]))
    file = touched(arm, tmp_path / "fixture.csv", named(), np.random.default_rng(3), place=place)
    outcome = run("identify", "frame", robot, file, "--name", "table", "--out", tmp_path / "out")
    assert outcome.status == 0
    assert '[FALSE,TRUE,"",[[650.000,-100.000,400.000],[0.707107,0.000000,0.000000,0.707107]]' in outcome.out
    assert "{X 650.000,Y -100.000,Z 400.000,A 90.0000,B 0.0000,C 0.0000}" in outcome.out
    assert "UR: p[0.650000,-0.100000,0.400000,0.000000,0.000000,1.570796]" in outcome.out
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    assert np.allclose(found["xyz_m"], place[:3, 3], atol=2e-6)
    assert found["kind"] == "frame" and found["method"] == "points" and found["touching_known"]


def test_a_ball_at_the_tip_is_taken_off_blocks_and_trays(tmp_path: Path) -> None:
    """Faces of a block are touched from outside, walls of a tray from inside: the centre of the ball is on the other side."""
    arm, model, _ = exact(tmp_path)
    radius = 0.003
    tray = {
        "1": BLOCK["1"],
        "2": [(x, y, -z) for x, y, z in BLOCK["2"]],
        "3": [(x, y, -z) for x, y, z in BLOCK["3"]],
    }
    for number, (of, side) in enumerate([(BLOCK, -1.0), (tray, 1.0)]):
        towards = {
            "1": np.array([0, 0, radius]),
            "2": np.array([0, side * radius, 0]),
            "3": np.array([side * radius, 0, 0]),
        }
        places = [(name, tuple((np.array(w) + towards[name]).tolist())) for name, w in faces(of)]
        file = touched(arm, tmp_path / f"{number}.csv", places, np.random.default_rng(4), columns="face")
        found = identify_work_object(model, read_frame_touches(file, model), tip_radius=radius)
        assert np.abs(off(arm, found)[0]).max() < 2e-6


def test_a_wrong_touch_is_named_and_left_out(tmp_path: Path) -> None:
    """One hole was missed by 2 mm, on an arm whose joints are off by a quarter of a milliradian."""
    arm = StrangerArm(5, axes=tuple(SIX), size=0.3, point_error=(0, 0, 0))
    model = RobotModel.from_yaml(arm.write(tmp_path))
    places = named(times=2)
    places[6] = ("B", (0.3, 0.002, 0.0))
    file = touched(arm, tmp_path / "touches.csv", places, np.random.default_rng(4), noise=5e-5)
    lines = file.read_text().splitlines()
    lines[7] = lines[7].replace("0.3,0.002,0.0", "0.3,0.0,0.0")
    file.write_text("\n".join(lines) + "\n")
    found = identify_work_object(model, read_frame_touches(file, model))
    assert [int(i) for i in np.flatnonzero(~found.fit.kept)] == [6]
    assert "pose 7" in " ".join(found.remarks)
    assert np.linalg.norm(off(arm, found)[0]) < 1e-3


def test_the_arm_and_the_touching_are_told_apart(tmp_path: Path) -> None:
    """An uncalibrated arm is blamed for its part; a calibration narrows the interval to what no point tells of the arm's own base."""
    arm, rng = StrangerArm(7, axes=tuple(SIX), point_error=(0, 0, 0)), np.random.default_rng(7)
    model = RobotModel.from_yaml(arm.write(tmp_path))
    file = touched(arm, tmp_path / "touches.csv", named(times=2), rng, noise=2e-5)
    blurred = identify_work_object(model, read_frame_touches(file, model))
    q = arm.postures(60, rng)
    poses = read_poses(arm.write_poses(tmp_path / "points.csv", q, arm.measured(q, rng)), model)
    calibrated = calibrate(model, poses, terms=["kinematic"]).model
    sharp = identify_work_object(calibrated, read_frame_touches(file, model))
    assert sharp.half_width.max() < 0.5 * blurred.half_width.max()
    assert (np.abs(off(arm, sharp)[0]) < sharp.half_width).all()
    assert sharp.fit.rms < 0.5 * blurred.fit.rms
    assert "not calibrated" in blurred.remarks[0]
    assert "its calibration leaves" in sharp.remarks[0]


def test_a_tip_that_is_not_known_well_widens_the_interval(tmp_path: Path) -> None:
    arm, model, robot = exact(tmp_path)
    file = touched(arm, tmp_path / "touches.csv", named(), np.random.default_rng(7), noise=2e-5)
    robot.write_text(robot.read_text().replace("0.08]}", "0.08], std: [0.002, 0.002, 0.002]}"))
    known = RobotModel.from_yaml(robot)
    narrow, wide = (identify_work_object(m, read_frame_touches(file, m)) for m in (model, known))
    assert wide.half_width.min() > 0.0039
    assert np.allclose(wide.origin, narrow.origin)


def test_three_touches_do_not_tell_what_touching_adds(tmp_path: Path) -> None:
    arm, model, _ = exact(tmp_path)
    places = [("origin", (0.0, 0, 0)), ("x", (0.25, 0.0, 0.0)), ("xy", (0.1, 0.2, 0.0))]
    place = PLACE @ rigid(rodrigues(np.array([1.0, 0, 0]), np.pi), np.zeros(3))
    file = touched(arm, tmp_path / "t.csv", places, np.random.default_rng(3), columns="point", place=place)
    found = identify_work_object(model, read_frame_touches(file, model))
    assert "is not known" in found.remarks[0]
    assert "away from the tool" in " ".join(found.remarks)
    assert found.document()["touching_std_m"] is None


def test_symmetric_points_cannot_be_checked(tmp_path: Path) -> None:
    arm, model, _ = exact(tmp_path)
    square = [("A", (0.0, 0, 0)), ("B", (0.2, 0, 0)), ("C", (0.2, 0.2, 0)), ("D", (0.0, 0.2, 0))]
    file = touched(arm, tmp_path / "t.csv", square, np.random.default_rng(3), noise=1e-4)
    assert "names cannot be checked" in " ".join(
        identify_work_object(model, read_frame_touches(file, model)).remarks
    )


def test_bad_touches_of_points(tmp_path: Path, run) -> None:
    arm, _, robot = exact(tmp_path)
    file = touched(arm, tmp_path / "touches.csv", named(), np.random.default_rng(3), noise=1e-4)
    text = file.read_text()
    header, *rows = text.splitlines()

    def refused(code: str, *names: str) -> None:
        outcome = run("identify", "frame", robot, file)
        assert (outcome.status, outcome.out) == (2, "")
        assert_refusal(outcome.err, code, *names)

    def told(of) -> str:
        return (
            "\n".join([header] + [",".join([*row.split(",")[:6], *of(*row.split(",")[6:])]) for row in rows])
            + "\n"
        )

    file.write_text(
        told(lambda n, *w: ({"B": "C", "C": "B"}.get(n, n), *map(str, HOLES[{"B": "C", "C": "B"}.get(n, n)])))
    )
    refused("E-TOOL-022", "B and C", "swapped")
    file.write_text(told(lambda n, x, y, z: (n, y, x, z)))
    refused("E-TOOL-021", "mirror image")
    file.write_text(told(lambda n, *w: (n, *(str(1000 * float(v)) for v in w))))
    refused("E-TOOL-023", "mm")
    file.write_text(told(lambda n, *w: (n, *(str(1.2 * float(v)) for v in w))))
    refused("E-TOOL-024", "1.2")
    file.write_text("\n".join([header, *rows[:2]]) + "\n")
    refused("E-TOOL-018", "2")
    file.write_text("\n".join([header, *rows[:2], rows[1].replace("B,0.3,", "F,0.2,")]) + "\n")
    refused("E-TOOL-019", "line")
    file.write_text("\n".join([header, *rows, rows[1].replace("B,0.3,", "B,0.2,")]) + "\n")
    refused("E-TOOL-015", "B", "line", "3")


def test_bad_touches_of_faces_and_axes(tmp_path: Path) -> None:
    arm, model, _ = exact(tmp_path)
    file = touched(arm, tmp_path / "t.csv", faces(BLOCK), np.random.default_rng(3), columns="face")
    header, *rows = file.read_text().splitlines()

    def fails(code: str, lines: list[str], *names: str, head: str = header) -> None:
        file.write_text("\n".join([head, *lines]) + "\n")
        with refused(code, *names):
            identify_work_object(model, read_frame_touches(file, model))

    fails("E-TOOL-017", rows[2:], "face 1", "2")
    fails("E-TOOL-017", rows[:5] + rows[7:], "face 2", "1")
    fails("E-TOOL-017", rows[:7], "face 3", "0")
    fails("E-TOOL-020", [*rows[:4], rows[4], rows[4], rows[7]], "face 2")
    fails("E-TOOL-014", [row[:-1] + "top" for row in rows], "column", "face", "top")
    fails("E-TOOL-013", [*rows[:-1], rows[-1][:-1] + "4"], "4", "1")
    axis = header.replace("face", "point")
    three = [row[:-1] + name for row, name in zip(rows, ("origin", "x"), strict=False)]
    fails("E-TOOL-016", three, "xy", head=axis)
    fails("E-TOOL-012", [row[:-2] for row in rows], "face", head=header[: -len(",face")])


def frame_inside(seed: int, folder: Path, places: list, columns: str) -> np.ndarray:
    """Whether the six numbers of a frame lie in their intervals, of one uncalibrated arm."""
    arm = StrangerArm(seed, axes=tuple(SIX), size=1.5, point_error=(0, 0, 0))
    model = RobotModel.from_yaml(arm.write(folder / str(seed)))
    file = touched(
        arm, folder / f"{seed}.csv", places, np.random.default_rng(seed), noise=5e-5, columns=columns
    )
    found = identify_work_object(model, read_frame_touches(file, model))
    origin, angle = off(arm, found)
    return np.array([np.abs(origin) <= found.half_width, np.abs(angle) <= found.angular_half_width])


def coverage(folder: Path, seeds: range, places: list, columns: str) -> float:
    """Share of the six numbers of a frame within their intervals, of uncalibrated arms."""
    return float(np.mean(over_seeds(frame_inside, seeds, folder, places, columns)))


def test_intervals_cover_one_arm(tmp_path: Path) -> None:
    assert coverage(tmp_path, range(300, 301), named(), "point,wx,wy,wz") > 0.6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("places", "columns"),
    [
        (named(), "point,wx,wy,wz"),
        (faces(BLOCK), "face"),
        ([("origin", (0.0, 0, 0)), ("x", (0.25, 0.0, 0.0)), ("xy", (0.1, 0.2, 0.0))] * 2, "point"),
    ],
    ids=["points", "faces", "axes"],
)
def test_intervals_of_frames_cover(tmp_path: Path, places: list, columns: str) -> None:
    """Of 40 arms with joints off by 1.2 mrad and 0.45 mm, uncalibrated."""
    assert coverage(tmp_path, range(300, 340), places, columns) > 0.9


def frame_of_calibrated_inside(seed: int, folder: Path) -> np.ndarray:
    """The same of an arm that is calibrated with a tracker."""
    arm, rng = StrangerArm(seed, axes=tuple(SIX), point_error=(0, 0, 0)), np.random.default_rng(seed)
    folder = folder / str(seed)
    model = RobotModel.from_yaml(arm.write(folder))
    q = arm.postures(60, rng)
    poses = read_poses(arm.write_poses(folder / "points.csv", q, arm.measured(q, rng)), model)
    model = calibrate(model, poses, terms=["kinematic"]).model
    file = touched(arm, folder / "touches.csv", named(), rng, noise=5e-5)
    found = identify_work_object(model, read_frame_touches(file, model))
    q = arm.postures(300, rng)
    turned, moved = rigid_motion(
        points(arm, q), point_kinematics(model, q, point="smr", jacobians=False).position
    )
    between = (turned @ PLACE[:3, :3]).T @ found.rotation
    angle = np.array([between[2, 1], between[0, 2], between[1, 0]])
    inside = [
        np.abs(found.origin - turned @ PLACE[:3, 3] - moved) <= found.half_width,
        np.abs(angle) <= found.angular_half_width,
    ]
    return np.array(inside)


@pytest.mark.slow
def test_intervals_of_frames_on_calibrated_arms_cover(tmp_path: Path) -> None:
    """Of 20 arms, each calibrated with a tracker, in the base frame that the calibration gives."""
    assert np.mean(over_seeds(frame_of_calibrated_inside, range(400, 420), tmp_path)) > 0.88
