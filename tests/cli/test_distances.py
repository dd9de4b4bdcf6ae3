"""`calibrate` from the lengths of draw-wires, dial gauges, and contacts with planes, lines and spheres, on an arm of strangers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal
from stranger_arm import SIX, StrangerArm

from flexcal import RobotModel, calibrate, read_poses
from flexcal.calibration.measurement import predict_measurements
from flexcal.cli.main import main
from flexcal.data.poses import concatenate
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import propagated_covariance_root

SIGMA = 5e-5
ANCHORS = {"east": (1.6, 0.9, 0.1), "west": (1.2, -1.4, 0.3), "top": (-0.3, 0.3, 2.6)}
ZEROS = {"east": 0.02, "west": -0.03, "top": 0.05}
NORMALS = ((0.05, -0.02, 1.0), (1.0, 0.1, 0.2), (0.1, 1.0, -0.1))
PLACES = ((0.05, 0.1, -0.25), (0.25, 0.0, 0.1), (0.0, -0.2, 0.1))
RADII = (0.12, 0.15, 0.18)


def points(arm: StrangerArm, q: np.ndarray) -> np.ndarray:
    """True positions (N, 3) of the reflector in the base frame."""
    return (arm.tool(q, true=True) @ np.append(arm.true_xyz, 1.0))[:, :3]


def reached(arm: StrangerArm, off: Callable[[np.ndarray], np.ndarray], q: np.ndarray) -> np.ndarray | None:
    """Joint positions near `q` where `off` (k,) of the point vanishes, by Newton's method with the shortest steps."""
    for _ in range(20):
        now = off(points(arm, q[None])[0])
        if np.linalg.norm(now) < 1e-11:
            return q
        near = q + 1e-6 * np.eye(arm.n)
        slope = np.array([(off(p) - now) / 1e-6 for p in points(arm, near)]).T
        q = q - np.linalg.lstsq(slope, now, rcond=None)[0]
        if np.abs(q).max() > 3:
            return None
    return None


def table(path: Path, q: np.ndarray, header: tuple[str, ...], columns: list[tuple]) -> Path:
    lines = [",".join([*(f"q{i + 1}" for i in range(q.shape[1])), *header])]
    lines += [",".join([*map(repr, a.tolist()), *map(str, b)]) for a, b in zip(q, columns, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def lengths(
    arm: StrangerArm, q: np.ndarray, wires: tuple[str, ...], rng: np.random.Generator, sigma: float
) -> list[tuple]:
    """What a wire read at each pose: its name, and the length without its zero."""
    at, rows = points(arm, q), []
    for point, name in zip(at, rng.choice(wires, len(q)).tolist(), strict=True):
        read = np.linalg.norm(point - ANCHORS[name]) - ZEROS[name] + sigma * rng.normal()
        rows.append((name, repr(float(read))))
    return rows


def contacts(
    arm: StrangerArm, kind: str, count: int, rng: np.random.Generator, sigma: float
) -> tuple[np.ndarray, list[tuple]]:
    """Joint positions at contact with three planes, lines or spheres, off by the noise; "dial" reads planes from near them."""
    middle = points(arm, arm.postures(50, np.random.default_rng(5))).mean(axis=0)
    every, rows = [], []
    for i, (normal, place) in enumerate(zip(NORMALS, PLACES, strict=True)):
        axis, centre = np.array(normal) / np.linalg.norm(normal), middle + place
        across = np.linalg.svd(axis[None])[2][1:]

        def off(p: np.ndarray, error: np.ndarray, axis=axis, centre=centre, across=across, i=i) -> np.ndarray:
            if kind == "line":
                return across @ (p - centre) - error[:2]
            if kind == "sphere":
                return np.array([np.linalg.norm(p - centre) - RADII[i] - error[0]])
            return np.array([axis @ (p - centre) - error[0]])

        found = 0
        while found < count:
            error = sigma * rng.normal(size=2)
            near = np.zeros(2) if kind != "dial" else rng.uniform(0, 0.01, 2)
            q = reached(
                arm,
                lambda p, error=near if kind == "dial" else error, off=off: off(p, error),
                arm.postures(1, rng)[0],
            )
            if q is None:
                continue
            found += 1
            every.append(q)
            rows.append((f"{kind}{i}", repr(float(near[0] + error[0])) if kind == "dial" else "0.0"))
    return np.array(every), rows


def faces(kind: str, std: float = SIGMA) -> str:
    declared = "plane" if kind == "dial" else kind
    return (
        "measurements: {"
        + ", ".join(f"{kind}{i}: {{kind: {declared}, std: {std}}}" for i in range(3))
        + "}\n"
    )


def wires(names: tuple[str, ...], more: str = f"std: {SIGMA}, scale_std: 1.0e-6") -> str:
    return "measurements: {" + ", ".join(f"{name}: {{kind: wire, {more}}}" for name in names) + "}\n"


def away(arm: StrangerArm, model: RobotModel, *, of_any_size: bool = False) -> float:
    """Root mean square distance, m, between true and predicted points at fresh poses, the base placed, and the size fitted, freely."""
    q = arm.postures(200, np.random.default_rng(99))
    truth, found = points(arm, q), point_kinematics(model, q, point="smr", jacobians=False).position
    truth, found = truth - truth.mean(axis=0), found - found.mean(axis=0)
    left, sizes, right = np.linalg.svd(truth.T @ found)
    turned = found @ (left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right).T
    size = sizes.sum() / (found**2).sum() if of_any_size else 1.0
    return float(np.sqrt(np.mean(np.sum((size * turned - truth) ** 2, axis=1))))


def measured(
    folder: Path, kind: str, seed: int, sigma: float, count: int = 180
) -> tuple[StrangerArm, Path, Path]:
    """An arm, its robot.yaml, and a file of `kind`."""
    arm, rng = StrangerArm(seed, axes=tuple(SIX)), np.random.default_rng(1000 + seed)
    if kind in ("wire", "wires"):
        names = ("east",) if kind == "wire" else tuple(ANCHORS)
        robot = arm.write(folder, wires(names))
        q = arm.postures(count, rng)
        return arm, robot, table(folder / "m.csv", q, ("wire", "length"), lengths(arm, q, names, rng, sigma))
    robot = arm.write(folder, faces(kind))
    q, rows = contacts(arm, kind, count // 3, rng, sigma)
    return arm, robot, table(folder / "m.csv", q, ("touched", "reading"), rows)


@pytest.mark.parametrize("kind", ["wire", "wires", "dial", "plane", "line", "sphere"])
def test_an_arm_is_found_from_readings_of_one_number(tmp_path: Path, kind: str) -> None:
    """Exact readings give the arm to micrometres; contacts alone give it up to its size, which is said."""
    arm, robot, file = measured(tmp_path, kind, 3, 0.0, 120)
    model = RobotModel.from_yaml(robot)
    sized = not kind.startswith("wire")
    result = calibrate(model, read_poses(file, model), terms=["kinematic"])
    assert away(arm, model, of_any_size=sized) > 2e-3
    assert away(arm, result.model, of_any_size=sized) < 4e-6
    said = " ".join(result.document()["remarks"])
    assert ("how large the robot is" in said) == sized
    assert ("the lengths of east (± 0.001 ‰)" in said) == (not sized)


@pytest.mark.parametrize("kind", ["wires", "plane", "line", "sphere"])
def test_derivatives_of_readings(tmp_path: Path, kind: str) -> None:
    """Against differences of the predicted readings, at a robot that is off."""
    _, robot, file = measured(tmp_path, kind, 5, SIGMA, 18)
    model = RobotModel.from_yaml(robot)
    poses = read_poses(file, model)
    rng = np.random.default_rng(0)
    values = {
        f"station.{s}.{key}": value
        for s in poses.stations
        for key, value in zip(
            ("x", "y", "z", "rx", "ry", "rz", "zero", "scale"),
            [*rng.normal(size=7).tolist(), 0.01],
            strict=True,
        )
    }
    model = model.with_stations(poses.places).with_values(values)
    names = [*values, "a2.offset", "a3.length_x", "a5.misalignment_2", "tool.length_z"]
    at = predict_measurements(model, poses, jacobians=True)
    columns = at.jacobian(names)
    for k, name in enumerate(names):
        above, below = (
            predict_measurements(model.with_values({name: model.value(name) + h}), poses).residual
            for h in (1e-6, -1e-6)
        )
        assert np.allclose((below - above) / 2e-6, columns[:, :, k], atol=2e-7), name
    assert not columns[~at.readings.present].any()


def test_command_line_with_wires_beside_a_tracker(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """Wrong lengths typed by hand are listed, all of them and nothing else, and do no harm; tracker and wire together are better."""
    arm, robot, file = measured(tmp_path, "wire", 8, SIGMA, 150)
    lines = file.read_text().splitlines()
    typed = {12: 0.03, 60: -0.1, 61: 0.009, 140: 0.05}
    for row, error in typed.items():
        cells = lines[row].split(",")
        cells[-1] = repr(float(cells[-1]) + error)
        lines[row] = ",".join(cells)
    file.write_text("\n".join(lines) + "\n")
    assert (
        main(["calibrate", str(robot), str(file), "--out", str(tmp_path / "wire"), "--terms", "kinematic"])
        == 0
    )
    found = json.loads((tmp_path / "wire" / "results.json").read_text())
    assert sorted(item["pose"] for item in found["outliers"]) == sorted(typed)
    rng = np.random.default_rng(4)
    q = arm.postures(25, rng)
    tracker = arm.write_poses(tmp_path / "points.csv", q, arm.measured(q, rng, SIGMA), SIGMA)
    model = RobotModel.from_yaml(robot)
    single = away(arm, calibrate(model, read_poses(tracker, model), terms=["kinematic"]).model)
    both = calibrate(model, read_poses([tracker, file], model), terms=["kinematic"])
    assert away(arm, both.model) < 0.8 * single
    assert (tmp_path / "wire" / "report.html").stat().st_size > 1e5
    said = capsys.readouterr().out
    assert "difference from what was measured" in said
    assert "--hold-out COLUMN" in said


def test_wires_left_out_by_recording(tmp_path: Path, run) -> None:
    """The errors at recordings that the fit has not seen are those of the noise, without what was typed wrongly."""
    _, robot, file = measured(tmp_path, "wire", 12, SIGMA, 150)
    lines = file.read_text().splitlines()
    cells = lines[20].split(",")
    lines[20] = ",".join([*cells[:-1], repr(float(cells[-1]) + 0.08)])
    marked = [lines[0] + ",day", *(f"{line},day{k // 50}" for k, line in enumerate(lines[1:]))]
    file.write_text("\n".join(marked) + "\n")
    outcome = run(
        "calibrate",
        robot,
        file,
        "--hold-out",
        "day",
        "--terms",
        "kinematic",
        "--out",
        tmp_path / "o",
        "--json",
    )
    held = json.loads(outcome.out)["held_out"]
    assert held["outliers"] == 1
    assert held["mean_mm"] < 0.12


def test_a_wire_of_unknown_noise_beside_a_tracker(tmp_path: Path) -> None:
    """The tracker's sigma is stated, the wire's is not: it has the default, and together they are better than the tracker alone."""
    arm, robot, file = measured(tmp_path, "wire", 9, SIGMA, 120)
    robot.write_text(robot.read_text().replace(f"std: {SIGMA}, ", ""))
    rng = np.random.default_rng(5)
    q = arm.postures(20, rng)
    tracker = arm.write_poses(tmp_path / "points.csv", q, arm.measured(q, rng, SIGMA), SIGMA)
    model = RobotModel.from_yaml(robot)
    single = away(arm, calibrate(model, read_poses(tracker, model), terms=["kinematic"]).model)
    both = read_poses([tracker, file], model)
    assert both.sigma_given
    assert away(arm, calibrate(model, both, terms=["kinematic"]).model) < single


@pytest.mark.parametrize("seed", [21, 22])
def test_wires_of_different_scales(tmp_path: Path, seed: int) -> None:
    """Drums that are off by a per mille, each by its own: what the wires agree on is found, and the size to the mean of their scales."""
    arm, robot, file = measured(tmp_path, "wires", seed, SIGMA)
    robot.write_text(robot.read_text().replace("scale_std: 1.0e-6", "scale_std: 1.0e-3"))
    off = dict(zip(ANCHORS, 1e-3 * np.random.default_rng(seed).normal(size=3), strict=True))
    model = RobotModel.from_yaml(robot)
    poses = read_poses(file, model)
    poses.position[:, 0] /= 1 + np.array([off[name] for name in poses.station.tolist()])
    result = calibrate(model, poses, terms=["kinematic"])
    assert away(arm, result.model, of_any_size=True) < 6e-5
    found = np.array([result.estimate.values[f"station.{name}.scale"] for name in off])
    differences = found - found.mean() - (np.array(list(off.values())) - np.mean(list(off.values())))
    assert np.abs(differences).max() < 2e-4
    size = result.document()["size"]
    assert len(size["standards"]) == 3
    # of three wires known to a per mille, and nominal lengths to half of one
    assert 2e-4 < size["std"] < 5.8e-4


def test_the_tracker_tells_the_scale_of_a_wire(tmp_path: Path) -> None:
    """Beside a tracker a wire that reads one per mille too much does no harm; alone nominal lengths tell it in part."""
    arm, robot, file = measured(tmp_path, "wire", 31, SIGMA, 120)
    robot.write_text(robot.read_text().replace("scale_std: 1.0e-6", "scale_std: 1.0e-3"))
    rng = np.random.default_rng(6)
    q = arm.postures(25, rng)
    tracker = arm.write_poses(tmp_path / "points.csv", q, arm.measured(q, rng, SIGMA), SIGMA)
    model = RobotModel.from_yaml(robot)
    points, readings = read_poses(tracker, model), read_poses(file, model)
    readings.position[:, 0] *= 1.001
    bare = calibrate(model, readings, terms=["kinematic"], tolerances=False).estimate
    assert bare.std("station.east.scale") is None
    assert bare.values["station.east.scale"] == pytest.approx(0.0, abs=3e-5)
    alone = calibrate(model, readings, terms=["kinematic"]).estimate
    std = alone.std("station.east.scale")
    assert std is not None
    assert 2 * std < 1.2e-3
    assert abs(alone.values["station.east.scale"] + 1e-3) < 2 * std
    both = calibrate(model, concatenate([points, readings]), terms=["kinematic"])
    std = both.estimate.std("station.east.scale")
    assert std is not None
    assert std < 3e-4
    assert abs(both.estimate.values["station.east.scale"] - (1 / 1.001 - 1)) < 3 * std
    assert away(arm, both.model) < away(arm, calibrate(model, points, terms=["kinematic"]).model)


def test_a_wire_that_was_zeroed_again_is_told(tmp_path: Path) -> None:
    """Half of the readings are 2 mm longer: the remark says where; an untouched wire has no such remark."""
    _, robot, file = measured(tmp_path, "wire", 6, SIGMA)
    model = RobotModel.from_yaml(robot)
    poses = read_poses(file, model)
    assert "jump" not in " ".join(calibrate(model, poses, terms=["kinematic"]).document()["remarks"])
    poses.position[100:, 0] += 2e-3
    said = " ".join(calibrate(model, poses, terms=["kinematic"]).document()["remarks"])
    assert "the readings jump: east by +" in said
    assert "between poses 100 and 101" in said


def test_bad_files_of_distances(tmp_path: Path, run) -> None:
    arm, robot, file = measured(tmp_path, "wire", 2, SIGMA, 40)
    text, declared = file.read_text(), robot.read_text()

    def refused(code: str, *named: str, file_text: str = text, yaml: str = declared) -> None:
        robot.write_text(yaml)
        file.write_text(file_text)
        outcome = run("calibrate", robot, file)
        assert (outcome.status, outcome.out) == (2, "")
        assert_refusal(outcome.err, code, *named)

    refused("E-POSES-061", "eats", "east", file_text=text.replace("east", "eats", 1))
    refused("E-POSES-059", "kind: wire", yaml=declared[: declared.index("measurements")])
    refused(
        "E-POSES-060",
        "wire",
        yaml=declared.replace("east:", "west: {kind: wire}, east:"),
        file_text=without_wire(text),
    )
    refused("E-POSES-011", "length", file_text=text.replace(text.splitlines()[3].split(",")[-1], "-0.2"))
    refused("E-ROBOT-056", "std", yaml=declared.replace(f"std: {SIGMA}", "std: 0"))
    flat = np.tile(arm.postures(1, np.random.default_rng(1)), (40, 1))
    flat[:, 0] = np.linspace(-1, 1, 40)
    rows = lengths(arm, flat, ("east",), np.random.default_rng(1), 0.0)
    flat[:, 1:] += 1.1e-3 * np.random.default_rng(2).normal(size=flat[:, 1:].shape)
    table(file, flat, ("wire", "length"), rows)
    refused("E-CAL-021", "east", "plane", file_text=file.read_text())
    shuffled = text.splitlines()
    lengths_alone = [line.rpartition(",")[2] for line in shuffled[1:]]
    other = [
        f"{line.rpartition(',')[0]},{value}"
        for line, value in zip(shuffled[1:], lengths_alone[::-1], strict=True)
    ]
    refused("E-CAL-023", "east", file_text="\n".join([shuffled[0], *other]) + "\n")


def without_wire(text: str) -> str:
    return "\n".join(",".join([*(c := line.split(","))[:6], c[7]]) for line in text.splitlines()) + "\n"


def distance_errors(seed: int, folder: Path, kind: str) -> tuple[np.ndarray, float]:
    """Errors (40,) of distances between positions of one arm's tool over their standard deviations, and the reduced χ² of the fit."""
    arm, robot, file = measured(folder / str(seed), kind, seed, SIGMA)
    model = RobotModel.from_yaml(robot)
    result = calibrate(model, read_poses(file, model), terms=["kinematic"])
    q = arm.postures(80, np.random.default_rng(7))

    def apart(at: np.ndarray) -> np.ndarray:
        between = np.linalg.norm(at[:40] - at[40:], axis=1)
        return between if kind.startswith("wire") else between / between.mean()

    def predicted(robot: RobotModel) -> np.ndarray:
        return apart(point_kinematics(robot, q, point="smr", jacobians=False).position)

    std = np.linalg.norm(propagated_covariance_root(result.model, predicted), axis=1)
    return (predicted(result.model) - apart(points(arm, q))) / std, result.estimate.reduced_chi2


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["wire", "wires", "dial", "plane", "line", "sphere"])
def test_intervals_of_distances_cover(tmp_path: Path, kind: str) -> None:
    """Distances between positions of the tool, relative to their mean where the readings tell no size, on 20 arms."""
    scores, chi = zip(*over_seeds(distance_errors, range(60, 80), tmp_path, kind), strict=True)
    assert np.mean(np.abs(scores) < 1.96) > 0.92
    assert 0.75 < np.sqrt(np.mean(np.square(scores))) < 1.2
    assert 0.88 < np.mean(chi) < 1.05
