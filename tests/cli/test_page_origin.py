"""Pages beside plans name the command that makes them again, and the files they were made of."""

from __future__ import annotations

import html
from pathlib import Path

import pytest

from flexcal.files.formats import sha256_of

BESIDE = "frequency_poses.csv", "cell.yaml"


@pytest.mark.parametrize(
    ("line", "files"),
    [
        (
            "design trajectory robot.yaml --count 1 --duration 2 --base-frequency 1 --steps 1 --out plan.yaml",
            (),
        ),
        ("design frequency robot.yaml --out plan.yaml", BESIDE),
        ("design frequency robot.yaml --poses frequency_poses.csv --plan paper --out plan.yaml", BESIDE),
        ("design poses robot.yaml --random --count 3 --out plan.yaml", ()),
        (
            "design poses robot.yaml --count 20 --candidates 80 --working box.csv --out plan.yaml",
            ("box.csv",),
        ),
        ("design poses robot.yaml --count 20 --from drawn.csv --out plan.yaml", ("drawn.csv",)),
    ],
)
def test_plan(
    run, tx90l_folder: Path, monkeypatch: pytest.MonkeyPatch, line: str, files: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tx90l_folder)
    Path("box.csv").write_text("x,y,z\n0.6,0.1,0.5\n0.7,-0.1,0.6\n0.6,0.3,0.7\n", "utf-8")
    if "drawn.csv" in files:
        assert (
            run("design", "poses", "robot.yaml", "--random", "--count", "60", "--out", "drawn.csv").status
            == 0
        )
    done = run(*line.split())
    assert done.status == 0, done.err
    page = html.unescape(Path("plan.html").read_text("utf-8"))
    assert f"flexcal {line}" in page
    for name in ("robot.yaml", "tx90l.urdf", *files):
        assert sha256_of(name) in page, name
