"""The command line that the help shows for every verb, run as it stands where what it reads is there."""

from __future__ import annotations

import html
import json
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_files import read_csv, write_csv
from newcomer_robot import urdf_text
from servo_arm import TRUTH, arm, command, simulate, write_log
from two_links import HELD, PAYLOAD, swings, two_links

from flexcal.calibration.measurement import predict_measurements
from flexcal.cli.arguments.verb_table import VERBS
from flexcal.cli.main import main
from flexcal.data.poses import read_poses, write_poses
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.files.formats import sha256_of
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel

ran: list[str] = []


def run(line: str) -> None:
    """A command line of the help, in the current folder; the pages that it leaves say how to make them again, and of what."""
    words = shlex.split(line)
    given = {sha256_of(Path(word)) for word in words if Path(word).is_file()}
    before = pages()
    assert main(words[1:]) == 0, line
    ran.append(line)
    for page in (
        () if words[1] == "report" else (page for page, time in pages().items() if time != before.get(page))
    ):
        text = html.unescape(page.read_text(encoding="utf-8"))
        assert line in text and not [digest for digest in given if digest not in text], (line, page)


def pages() -> dict[Path, int]:
    """Pages below the current folder, and when they were written."""
    return {page: page.stat().st_mtime_ns for page in Path().rglob("*.html")}


def example(name: str) -> str:
    return next(verb.example for verb in VERBS if verb.name == name)


def own_robot(folder: Path, examples: Path) -> list[str]:
    (folder / "robot.urdf").write_text(urdf_text())
    return ["init"]


def foreign_file(folder: Path, examples: Path) -> list[str]:
    shutil.copytree(examples / "ur5_tracker", folder, dirs_exist_ok=True)
    header, rows = read_csv(folder / "grid.csv")
    write_csv(folder / "measured.csv", [name.upper() for name in header], rows[::20])
    return ["import", "completion"]


def small_study(folder: Path, examples: Path) -> list[str]:
    shutil.copytree(examples / "ur5_tracker", folder, dirs_exist_ok=True)
    text = (
        (folder / "study.yaml")
        .read_text("utf-8")
        .replace("count: 10", "count: 1")
        .replace("[20, 40]", "[12]")
    )
    (folder / "study.yaml").write_text(text, "utf-8")
    return ["study"]


def calibrated_arm(folder: Path, examples: Path) -> list[str]:
    """The real UR5, as if the robot that its calibration found were the real one: what a tracker sees of it is drawn from that."""
    shutil.copytree(examples / "ur5_tracker", folder, dirs_exist_ok=True)
    header, rows = read_csv(folder / "grid.csv")
    write_csv(folder / "poses.csv", header, rows[::7][:140])
    run("flexcal calibrate robot.yaml poses.csv --terms kinematic --out results")
    run("flexcal calibrate robot.yaml poses.csv --terms kinematic")
    shutil.copy("random.csv", "others.csv")
    header, rows = read_csv(folder / "random.csv")
    write_csv(folder / "targets.csv", header[:7], rows[:, :7])
    run(example("compensate"))
    (folder / "program.script").write_text("movej([-0.4, -0.8, 2.3, -1.6, 1.0, -0.1])\n", "utf-8")
    model = RobotModel.from_yaml(folder / "robot.yaml")
    measured = read_poses(folder / "random.csv", model)
    rng = np.random.default_rng(3)
    commands = pl.read_csv("commands.csv").select([f"q{i}" for i in range(1, 7)]).to_numpy()
    for name, q in (("nominal", measured.q), ("compensated", commands)):
        visited = replace(measured, q=q, sigma=np.full((len(q), 3), 2e-5), sigma_given=True)
        visits = visited.subset(np.tile(np.arange(len(q)), 3))
        seen = predict_measurements(model, visits).position + 2e-5 * rng.standard_normal((3 * len(q), 3))
        write_poses(folder / f"{name}.csv", replace(visits, position=seen))
    shutil.copy("compensated.csv", "visits.csv")
    shutil.copy("others.csv", "visit.csv")
    write_touches(folder, model)
    entry = {"drive_mode": 0, "homing_offset": 0, "range_min": 500, "range_max": 3600}
    motors = {name: {"id": k, **entry} for k, name in enumerate(model.joint_names, 1)}
    (folder / "motors.json").write_text(json.dumps(motors, indent=4), "utf-8")
    run("flexcal verify robot.yaml others.csv --out checked")
    run("flexcal repeatability robot.yaml visits.csv --out repeated")
    (folder / "robots").mkdir()
    shutil.copytree("results", "robots/ur5/2026-03-01")
    for name in ("robot.yaml", "ur5.urdf"):
        shutil.copy(name, "robots/ur5")
    return [
        "identify tool",
        "identify frame",
        "filter",
        "verify",
        "repeatability",
        "recheck",
        "map",
        "predict",
        "certificate",
        "report",
        "fleet",
        *EXPORTS,
    ]


def write_touches(folder: Path, model: RobotModel) -> None:
    """Poses at which the reflector's place touches one point, in orientations about one posture, and four points of a fixture."""
    rng = np.random.default_rng(8)
    start = np.array([0.2, -1.2, 1.6, -1.5, -1.5, 0.3])
    place = point_kinematics(model, start, jacobians=False).position[0]
    joints = [f"q{i}" for i in range(1, 7)]
    turned = start + 0.3 * rng.uniform(-1, 1, (8, 6)) * [0.5, 0.5, 0.5, 1, 1, 2]
    rows = [[k + 1, *row] for k, row in enumerate(reached(model, turned, place).tolist())]
    write_csv(folder / "touches.csv", ["pose", *joints], np.array(rows))
    holes = np.array([[0, 0, 0], [0.1, 0, 0], [0.08, 0.07, 0], [0.01, 0.09, 0.02]])
    q = reached(model, np.tile(start, (len(holes), 1)), place + holes)
    write_csv(folder / "fixture.csv", [*joints, "wx", "wy", "wz"], np.concatenate([q, holes], axis=1))


def reached(model: RobotModel, near: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Joint positions (N, n) near others at which the reflector's place is at the places, by Newton's method."""
    for _ in range(20):
        at = point_kinematics(model, near)
        back = np.linalg.pinv(at.motion_jacobian[:, :3, :, 2])
        near = near + np.matmul(back, (places - at.position)[:, :, None])[:, :, 0]
    return near


def recordings_of_two_payloads(folder: Path, examples: Path) -> list[str]:
    signals = "signals: {tau: {columns: [i1, i2], unit: A, gain: [50, 20]}}\n"
    robot = two_links(
        folder, f"dynamics: {{cutoff_hz: 20, decimation: 1, friction: classic}}\n{signals}{PAYLOAD}"
    )
    observation = Observation(robot, CLASSIC)
    (folder / "logs").mkdir()
    for name, held in (("free", 0 * HELD), ("loaded", HELD)):
        motion = swings(observation, held, 7)
        columns = {"t": motion.time, "payload": np.full(len(motion), held[0])}
        for i, gain in enumerate((50, 20)):
            columns |= {f"q{i + 1}": motion.q[:, i], f"i{i + 1}": motion.torque[:, i] / gain}
        pl.DataFrame(columns).write_csv(folder / "logs" / f"{name}.csv")
    run("flexcal identify gains robot.yaml logs/free.csv logs/loaded.csv --out gains")
    return ["identify gains"]


def servo_moves(folder: Path, examples: Path) -> list[str]:
    """Two links under a position controller, which a program of the tests simulates."""
    arm(folder)
    commands = command(16.0, 100.0, np.random.default_rng(5))
    write_log(folder / "moves.csv", 0.01, commands, simulate(TRUTH, commands[None], 100.0, step=5e-4)[0])
    run("flexcal identify actuators robot.yaml moves.csv --out actuators")
    return ["identify actuators", "export isaac"]


def exciting_motion(folder: Path, examples: Path) -> list[str]:
    shutil.copytree(
        examples / "tx40", folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("estimates.*")
    )
    run("flexcal identify dynamics robot.yaml exciting.parquet --hold-out last:0.3 --out dynamics")
    return ["identify dynamics"]


def virtual_robot(folder: Path, examples: Path) -> list[str]:
    """The procedure on the TX90L, with what people do between its verbs."""
    shutil.copytree(
        examples / "tx90l", folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("estimates.*")
    )
    run(example("design trajectory"))
    run("flexcal measure trajectory.yaml --cell virtual --out exciting")
    run("flexcal identify inertials robot.yaml exciting --out inertials")
    run(example("identify inertials"))
    run("flexcal design trajectory robot.yaml --loaded --out holding.yaml")
    run("flexcal measure holding.yaml --cell virtual --out loaded")
    run("flexcal identify payload robot.yaml loaded --out payload")
    assert sha256_of("loaded/plan.yaml") in Path("payload/report.html").read_text("utf-8")
    run(example("identify payload"))
    for name in (
        "design frequency",
        "export excitation",
        "measure",
        "identify response",
        "identify stiffness",
        "design poses",
    ):
        run(example(name))
    run("flexcal identify stiffness robot.yaml responses --out stiffness")
    run("flexcal measure poses.yaml --cell virtual --out measured")
    shutil.copy("measured/poses.csv", "poses.csv")
    run("flexcal design poses robot.yaml --random --count 30 --out others.yaml")
    run("flexcal measure others.yaml --cell virtual --out unseen")
    shutil.copy("unseen/poses.csv", "others.csv")
    run(example("calibrate"))
    run(example("verify"))
    return []


EXPORTS = tuple(
    verb.name for verb in VERBS if verb.words[0] == "export" and verb.words[1] not in ("isaac", "excitation")
)
PROCEDURE = (
    "design trajectory",
    "identify inertials",
    "identify payload",
    "design frequency",
    "export excitation",
    "measure",
)
PROCEDURE += ("identify response", "identify stiffness", "design poses", "calibrate", "verify")
PLACES = {
    own_robot: {"init"},
    foreign_file: {"import", "completion"},
    small_study: {"study"},
    calibrated_arm: {
        "identify tool",
        "identify frame",
        "verify",
        "repeatability",
        "recheck",
        "map",
        "compensate",
        "filter",
        "predict",
        "certificate",
        "report",
        "fleet",
        *EXPORTS,
    },
    recordings_of_two_payloads: {"identify gains"},
    servo_moves: {"identify actuators", "export isaac"},
    exciting_motion: {"identify dynamics"},
    virtual_robot: set(PROCEDURE),
}


def test_every_verb_has_a_place() -> None:
    """`demo` is run by tests/test_readme.py, and `serve` and `studio`, which go on, by tests of theirs."""
    named = {name for names in PLACES.values() for name in names}
    assert named | {"demo", "serve", "studio"} == {verb.name for verb in VERBS}


@pytest.mark.parametrize(
    "place", [own_robot, foreign_file, small_study, calibrated_arm], ids=lambda place: place.__name__
)
def test_quick_examples_run(place, tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here(place, tmp_path, examples, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize(
    "place",
    [recordings_of_two_payloads, servo_moves, exciting_motion, virtual_robot],
    ids=lambda place: place.__name__,
)
def test_slow_examples_run(place, tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here(place, tmp_path, examples, monkeypatch)


def here(place, tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the examples of a place in a folder made for them."""
    monkeypatch.chdir(tmp_path)
    ran.clear()
    for name in place(tmp_path, examples):
        run(example(name))
    assert PLACES[place] <= {verb.name for verb in VERBS if verb.example in ran}
