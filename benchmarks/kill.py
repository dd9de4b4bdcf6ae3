"""Verbs that are killed at every operation on files: each file is of the run before or of the new one, readers say where these are mixed,
and the next run leaves what one that was not killed leaves. A study, whose rows are kept and gone on with, has tests of its own.

`python -m benchmarks.kill [--cases calibrate verify …] [--every 1]`

A verb runs in a process forked from this one and is killed, without warning, before its n-th operation that changes files in the folder of
the robot; n goes through all of them.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pinocchio

from flexcal.cli.main import main as flexcal
from flexcal.errors import InputError
from flexcal.files.formats import read_estimates
from flexcal.files.transaction import LEDGER, Ledger, digest_on_disk, refuse_mixture
from flexcal.model.robot import RobotModel

EXAMPLES = Path(__file__).parent.parent / "examples"
_CHANGES = {
    "os.rename",
    "os.remove",
    "os.rmdir",
    "os.mkdir",
    "os.truncate",
    "os.chmod",
    "os.link",
    "os.symlink",
}
"""Audit events of what changes files, besides opening for writing."""
_USERS = "notes.txt"


@dataclass(frozen=True)
class Case:
    """A verb, in a copy of a robot's folder: command lines that lead to the state before, the one that is killed, the folder that it writes
    to, and the files in it that hold no duration or time, and so are the same whenever it runs; and files that the folder does not have."""

    name: str
    robot: str
    before: tuple[str, ...]
    killed: str
    out: str
    steady: tuple[str, ...]
    files: Mapping[str, str] = field(default_factory=dict)


_TOUCHES = """q1,q2,q3,q4,q5,q6
0.28957550,-1.38726369,2.26466142,-4.01831095,-1.86754466,-3.13321799
0.45485406,-1.29200939,1.55331120,-0.28554692,-2.68525066,-1.59585455
0.45456218,-1.29116907,1.55330275,-0.28639264,-2.68552609,1.54572614
0.17245181,-1.18379188,1.40623812,-0.22222255,-1.39736204,-0.01142470
-0.06296244,-1.48553449,1.79076719,-0.13432700,-0.06214422,-1.74378110
"""
"""Joint positions of the UR5 that bring one point to one place."""
_GRID = (EXAMPLES / "ur5_tracker" / "grid.csv").read_text()
_NOMINAL = "".join(f"{row.rsplit(',', 3)[0]}\n" for row in _GRID.splitlines())
"""Joint positions alone."""
_MOTORS = json.dumps({
    f"{joint}_joint": {"id": k, "drive_mode": 0, "homing_offset": 0, "range_min": 700, "range_max": 3300}
    for k, joint in enumerate(("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"))
})  # fmt: skip
_MOTORS_OF_ARM = """robot: arm.urdf
gravity: [0, 0, -9.81]
dynamics: {cutoff_hz: 20, decimation: 1, friction: classic}
signals: {tau: {columns: [i1, i2], unit: A, gain: [50, 20]}}
payload: {frame: lower, mass: 4.0, com: [0.3, 0, 0]}
"""


def _arm_log(payload: float) -> str:
    """Forty seconds of the arm with two links, which holds a mass (kg) or nothing."""
    model = pinocchio.buildModelFromUrdf(str(EXAMPLES / "servo_arm" / "arm.urdf"))
    held = pinocchio.Inertia(payload, np.array([0.3, 0, 0.05]), 0.02 * payload * np.eye(3))
    model.inertias[2] = model.inertias[2] + held
    data, rng = model.createData(), np.random.default_rng(7)
    rates, sizes, phases = (
        2 * np.pi * 0.1 * np.array([1, 2, 3, 5, 7]),
        rng.normal(size=(2, 5)),
        rng.uniform(0, 6, (2, 5)),
    )
    rows = ["t,q1,q2,i1,i2,payload"]
    for k in range(2000):
        angle = rates * k / 50.0 + phases
        q, dq, ddq = np.sum(
            sizes * np.array([np.sin(angle), rates * np.cos(angle), -(rates**2) * np.sin(angle)]), axis=2
        )
        friction = [3, 1] * dq + [0.4, 0.15] * np.sign(dq)
        currents = (pinocchio.rnea(model, data, q, dq, ddq) + friction) / [50, 20]
        rows.append(",".join(f"{value:.9f}" for value in (k / 50.0, *q, *currents, payload)))
    return "\n".join(rows) + "\n"


_TRAJECTORY = "design trajectory robot.yaml --count 1 --steps 2"
_EXCITING = (f"{_TRAJECTORY} --out trajectory.yaml", "measure trajectory.yaml --cell virtual --out exciting")
_LOADED = (
    f"{_TRAJECTORY} --loaded --seed 3 --out loaded.yaml",
    "measure loaded.yaml --cell virtual --out loaded",
)
_FREQUENCY = ("design frequency robot.yaml --plan quick --out frequency.yaml",
              "measure frequency.yaml --cell virtual --out frequency",
              "identify response robot.yaml frequency --out responses")  # fmt: skip
_EXCITATION = "export excitation frequency.yaml --out excitation --rate 250 --scale"
_CALIBRATE = "calibrate robot.yaml random.csv --terms kinematic --loss"
CASES = (
    Case("calibrate", "ur5_tracker", (f"{_CALIBRATE} squares --out out",), f"{_CALIBRATE} cauchy --out out", "out",
         ("estimates.yaml", "estimates.npz", "points.csv", "arm.npz")),
    Case("calibrate, new folder", "ur5_tracker", (), f"{_CALIBRATE} squares --out out", "out", ("estimates.npz", "points.csv")),
    Case("calibrate in place", "ur5_tracker", (f"{_CALIBRATE} squares",), f"{_CALIBRATE} cauchy", ".",
         ("estimates.yaml", "estimates.npz", "robot.yaml")),
    Case("calibrate --write-point", "ur5_tracker", (f"{_CALIBRATE} squares",),
         "calibrate robot.yaml grid.csv --terms kinematic --write-point", ".", ("estimates.npz", "robot.yaml")),
    Case("verify", "ur5_tracker", (f"{_CALIBRATE} squares", "verify robot.yaml random.csv --out out"),
         "verify robot.yaml grid.csv --out out", "out", ("points.csv", "arm.npz")),
    Case("design poses", "ur5_tracker", ("design poses robot.yaml --random --count 3 --out plan.yaml",),
         "design poses robot.yaml --random --count 4 --out plan.yaml", ".", ("plan.yaml",)),
    Case("measure", "tx90l", ("design poses robot.yaml --random --count 3 --out plan.yaml", "measure plan.yaml --cell virtual --out out"),
         "measure plan.yaml --cell virtual --seed 2 --out out", "out", ("plan.yaml", "poses.csv", "truth.yaml")),
    Case("import", "ur5_tracker", ("import robot.yaml random.csv --out measured.csv",),
         "import robot.yaml grid.csv --out measured.csv", ".", ("measured.csv",)),
    Case("export urdf", "ur5_tracker", (f"{_CALIBRATE} squares", "export urdf robot.yaml --out calibrated.urdf", f"{_CALIBRATE} cauchy"),
         "export urdf robot.yaml --out calibrated.urdf", ".", ("calibrated.urdf",)),
    Case("recheck", "ur5_tracker", (f"{_CALIBRATE} squares", "recheck robot.yaml random.csv --date 2026-01-01 --out out"),
         "recheck robot.yaml random.csv --date 2026-02-01 --out out", "out", ()),
    Case("map", "ur5_tracker", (f"{_CALIBRATE} squares", "map robot.yaml --count 300 --out map.html"),
         "map robot.yaml --count 400 --out map.html", ".", ()),
    Case("init", "ur5_tracker", (), "init ur5.urdf --out out", "out", ("robot.yaml",)),
    Case("report", "ur5_tracker", (f"{_CALIBRATE} squares --out out",), "report out", "out", ("points.csv",)),
    Case("export json", "ur5_tracker", (f"{_CALIBRATE} squares", "export json robot.yaml --out all.json", f"{_CALIBRATE} cauchy"),
         "export json robot.yaml --out all.json", ".", ("all.json",)),
    Case("export runtime", "ur5_tracker", (f"{_CALIBRATE} squares", "export runtime robot.yaml --out runtime.json", f"{_CALIBRATE} cauchy"),
         "export runtime robot.yaml --out runtime.json", ".", ("runtime.json",)),
    Case("export sdf", "ur5_tracker", (f"{_CALIBRATE} squares", "export sdf robot.yaml --out arm.sdf", f"{_CALIBRATE} cauchy"),
         "export sdf robot.yaml --out arm.sdf", ".", ("arm.sdf",)),
    Case("export mjcf", "tx90l", (), "export mjcf robot.yaml --out arm.xml", ".", ("arm.xml",)),
    Case("export dh", "ur5_tracker", (f"{_CALIBRATE} squares", "export dh robot.yaml --out dh.csv", f"{_CALIBRATE} cauchy"),
         "export dh robot.yaml --out dh.csv", ".", ("dh.csv",)),
    Case("export mdh", "ur5_tracker", (f"{_CALIBRATE} squares",), "export mdh robot.yaml --out mdh.csv", ".", ("mdh.csv",)),
    Case("export offsets", "ur5_tracker", (f"{_CALIBRATE} squares",), "export offsets robot.yaml --out offsets.csv", ".", ("offsets.csv",)),
    Case("export kinematics", "ur5_tracker", (f"{_CALIBRATE} squares",), "export kinematics robot.yaml --out ur.yaml", ".", ("ur.yaml",)),
    Case("export xacro", "ur5_tracker", (f"{_CALIBRATE} squares", "export xacro robot.yaml --out description", f"{_CALIBRATE} cauchy"),
         "export xacro robot.yaml --out description", "description", ()),
    Case("export lerobot", "ur5_tracker", (f"{_CALIBRATE} squares",),
         "export lerobot robot.yaml --calibration motors.json --out corrected.json", ".", ("corrected.json",), {"motors.json": _MOTORS}),
    Case("export isaac", "servo_arm", ("identify actuators robot.yaml moves.csv",), "export isaac robot.yaml --out groups.json", ".",
         ("groups.json",)),
    Case("identify actuators", "servo_arm", (), "identify actuators robot.yaml moves.csv", ".", ("estimates.yaml",)),
    Case("compensate", "ur5_tracker", (f"{_CALIBRATE} squares", "compensate robot.yaml nominal.csv --out out.csv", f"{_CALIBRATE} cauchy"),
         "compensate robot.yaml nominal.csv --out out.csv", ".", ("out.csv",), {"nominal.csv": _NOMINAL}),
    Case("predict", "ur5_tracker", (f"{_CALIBRATE} squares",), "predict robot.yaml nominal.csv --out tool.csv", ".", ("tool.csv",),
         {"nominal.csv": _NOMINAL}),
    Case("filter", "irb120_program", ("calibrate robot.yaml points.csv", "filter robot.yaml pick.mod --out there.mod",
                                      "calibrate robot.yaml points.csv --loss cauchy"),
         "filter robot.yaml pick.mod --out there.mod", ".", ("there.mod",)),
    Case("certificate", "ur5_tracker", (f"{_CALIBRATE} squares",),
         "certificate robot.yaml --targets nominal.csv --before grid.csv --after after.csv", ".", (),
         {"nominal.csv": _NOMINAL, "after.csv": _GRID}),
    Case("identify tool", "ur5_tracker", (f"{_CALIBRATE} squares",), "identify tool robot.yaml touches.csv --out tool", "tool", (),
         {"touches.csv": _TOUCHES}),
    Case("identify frame", "ur5_tracker", (f"{_CALIBRATE} squares",), "identify frame robot.yaml fixture.csv --out place", "place", (),
         {"fixture.csv": "\n".join(_GRID.splitlines()[:30]).replace(",x,y,z", ",wx,wy,wz", 1)}),
    Case("fleet", "ur5_tracker", (f"{_CALIBRATE} squares --out 2026-01-01", f"{_CALIBRATE} cauchy --out 2026-02-01",
                                  "fleet . --out fleet.csv", "verify robot.yaml grid.csv --estimates 2026-02-01 --out 2026-03-01"),
         "fleet . --out fleet.csv", ".", ("fleet.csv",)),
    Case("design trajectory", "tx90l", (_EXCITING[0],), f"{_TRAJECTORY} --seed 7 --out trajectory.yaml", ".", ("trajectory.yaml",)),
    Case("identify inertials", "tx90l", _EXCITING, "identify inertials robot.yaml exciting", ".", ("estimates.yaml",)),
    Case("identify dynamics", "tx40", ("identify dynamics robot.yaml exciting.parquet",),
         "identify dynamics robot.yaml exciting.parquet --estimator irls", ".", ("estimates.yaml",)),
    Case("identify payload", "tx90l", (*_EXCITING, *_LOADED), "identify payload robot.yaml loaded --free exciting --out load", "load",
         ("estimates.yaml",)),
    Case("identify response", "tx90l", _FREQUENCY, "identify response robot.yaml frequency --out responses", "responses", ()),
    Case("identify stiffness", "tx90l", _FREQUENCY, "identify stiffness robot.yaml responses", ".", ("estimates.yaml",)),
    Case("identify gains", "servo_arm", (), "identify gains motors.yaml free.csv loaded.csv --out gains", "gains", (),
         {"motors.yaml": _MOTORS_OF_ARM, "free.csv": _arm_log(0), "loaded.csv": _arm_log(4)}),
    Case("repeatability", "ur5_tracker", (f"{_CALIBRATE} squares",), "repeatability robot.yaml visits.csv --out visits", "visits", (),
         {"visits.csv": _GRID + _GRID.split("\n", 1)[1]}),
    Case("export excitation", "tx90l", (f"{_FREQUENCY[0]} --seed 3", f"{_EXCITATION} 0.5"), f"{_EXCITATION} 0.4", "excitation",
         ("manifest.csv", "phases.csv", "moves.csv")),
    Case("design frequency", "tx90l", _FREQUENCY[:1], "design frequency robot.yaml --plan quick --seed 2 --out frequency.yaml", ".",
         ("frequency.yaml",)),
)  # fmt: skip


def killed_runs(case: Case, every: int) -> Counter[str]:
    """How often each was found after a kill (old, new, mixed and named), and faults."""
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="kill_") as place:
        start, folder = Path(place, "start"), Path(place, "robot")
        shutil.copytree(EXAMPLES / case.robot, start)
        for name, text in {_USERS: "mine", **case.files}.items():
            (start / name).write_text(text)
        for command in case.before:
            _complete(command, start)
        shutil.copytree(start, folder)
        count = _complete(case.killed, folder)
        old, new = _digests(start), _digests(folder)
        for step in range(0, count, every):
            shutil.rmtree(folder)
            shutil.copytree(start, folder)
            status = _run(case.killed, folder, step)[0]
            if not os.WIFSIGNALED(status):
                found["not killed"] += 1  # it took another way, with fewer operations
                continue
            state, steady = _state(case, folder, old, new), [_name(case, file) for file in case.steady]
            found[state] += 1
            complete = all(_digests(folder).get(name) == new[name] for name in steady)
            if state == "old" and step % 5:
                continue
            try:
                _complete(case.killed, folder)
            except RuntimeError as problem:
                print(f"{case.name}, killed at {step}: {problem}", file=sys.stderr)
                found["FAULT: no next run"] += 1
                continue
            after = _digests(folder)
            same = complete or all(
                after[name] == new[name] for name in steady
            )  # else it was a run after the new one
            if after.keys() != new.keys() or not same:
                print(
                    f"{case.name}, killed at {step}: {sorted(after.items() ^ new.items())}", file=sys.stderr
                )
                found["FAULT: the next run left something else"] += 1
            found["next runs"] += 1
    return found


def _state(case: Case, folder: Path, old: dict[str, str], new: dict[str, str]) -> str:
    files = _digests(folder)
    if files[_USERS] != old[_USERS]:
        return "FAULT: a user's file has changed"
    RobotModel.from_yaml(folder / "robot.yaml")
    for estimates in folder.rglob("estimates.yaml"):
        read_estimates(estimates)
    out = folder / case.out
    ledger = Ledger.read(out) if (out / LEDGER).is_file() else Ledger({})
    known = {
        _name(case, name): {digest, ledger.change.get(name)} for name, (digest, _) in ledger.entries.items()
    }
    known |= {
        _name(case, name): {digest} for name, digest in ledger.change.items() if name not in ledger.entries
    }
    for name, digest in files.items():
        if digest not in (old.get(name), new.get(name)) and digest not in known.get(name, ()):
            return f"FAULT: {name} is of neither run"
    try:
        refuse_mixture(out)
    except InputError:
        return "mixed and named"
    return "old" if all(files.get(name) == digest for name, digest in old.items()) else "new"


def _name(case: Case, file: str) -> str:
    return os.path.normpath(os.path.join(case.out, file))


def _complete(command: str, folder: Path) -> int:
    """Run a command line to its end, and return the number of its operations on files; raises `RuntimeError` where it fails."""
    status, count = _run(command, folder, None)
    if status:
        raise RuntimeError(
            f"'{command}' ended with {status}: {(folder.parent / 'said.txt').read_text()[-500:]}"
        )
    return count


def _run(command: str, folder: Path, killed_at: int | None) -> tuple[int, int]:
    """Wait status and number of operations of a command line in a forked process."""
    told, tell = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.chdir(folder)
            for number, flags in (
                (1, os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
                (2, os.O_WRONLY | os.O_CREAT | os.O_APPEND),
            ):
                os.dup2(os.open(folder.parent / "said.txt", flags), number)
            seen = 0

            def watch(event: str, arguments: Sequence[object]) -> None:
                nonlocal seen
                writes = (
                    event == "open"
                    and isinstance(arguments[2], int)
                    and arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
                )
                path = (
                    arguments[0]
                    if (event in _CHANGES or writes) and isinstance(arguments[0], str | bytes | os.PathLike)
                    else None
                )
                if path is not None and os.path.abspath(os.fsdecode(path)).startswith(str(folder)):
                    if seen == killed_at:
                        os.kill(os.getpid(), signal.SIGKILL)
                    seen += 1

            sys.addaudithook(watch)
            status = flexcal(command.split())
            os.write(tell, str(seen).encode())
        finally:
            os._exit(status)
    os.close(tell)
    with os.fdopen(told, "rb") as stream:
        said = stream.read()
    return os.waitpid(child, 0)[1], int(said or b"0")


def _digests(folder: Path) -> dict[str, str]:
    """SHA-256 of the files in a folder by name, without temporary ones and the ledger."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    names = {path.relative_to(folder).as_posix(): path for path in files}
    return {name: digest_on_disk(path) for name, path in sorted(names.items()) if ".flexcal" not in name}


def main() -> int:
    """Print the counts, one line a verb; 1 where there was a fault."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", nargs="*", default=[case.name for case in CASES])
    parser.add_argument("--every", type=int, default=1)
    given = parser.parse_args()
    total: Counter[str] = Counter()
    for case in CASES:
        if case.name in given.cases:
            found = killed_runs(case, given.every)
            total += found
            print(
                f"{case.name:24s} {', '.join(f'{count} {what}' for what, count in sorted(found.items()))}",
                flush=True,
            )
    print(f"all: {', '.join(f'{count} {what}' for what, count in sorted(total.items()))}")
    return int(any(what.startswith("FAULT") for what in total))


def run(every: int = 4) -> list[tuple[str, float, str]]:
    """Share of the kills after which all was well."""
    rows = []
    for case in CASES:
        found = killed_runs(case, every)
        kills = found["old"] + found["new"] + found["mixed and named"]
        faults = sum(count for what, count in found.items() if what.startswith("FAULT"))
        rows.append(
            (
                case.name,
                1 - faults / max(kills, 1),
                ", ".join(f"{count} {what}" for what, count in sorted(found.items())),
            )
        )
    return rows


if __name__ == "__main__":
    sys.exit(main())
