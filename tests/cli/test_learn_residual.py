"""`flexcal identify dynamics --learn-residual`: what it adds to the predicted torques, and that it changes nothing else."""

import json
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_files import copied
from refusals import assert_refusal

from flexcal.cli.main import main
from flexcal.dynamics.residual import read_learned_residual


def arguments(folder: Path, *options: str) -> list[str]:
    files = [str(folder / name) for name in ("robot.yaml", "exciting.parquet")]
    return ["identify", "dynamics", *files, "--hold-out", "last:0.3", "--out", str(folder / "out"), *options]


@pytest.fixture(scope="module")
def folder(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX40 with classic friction, at 25 rows a second, for speed."""
    pytest.importorskip("sklearn", reason="scikit-learn (the extra 'learn') is not installed")
    folder = copied(examples / "tx40", tmp_path_factory.mktemp("tx40") / "robot")
    robot = folder / "robot.yaml"
    robot.write_text(robot.read_text().replace("decimation: 100}", "decimation: 200, friction: classic}"))
    with redirect_stdout(StringIO()) as out:
        assert main(arguments(folder, "--learn-residual")) == 0
    (folder / "said.txt").write_text(out.getvalue())
    return folder


def learned(folder: Path) -> dict:
    return json.loads((folder / "out" / "results.json").read_text())["learned_residual"]


def test_unseen_torques_are_predicted_better(folder: Path) -> None:
    """By a fifth at least; in the blocks that were left out of the fit too, motor by motor where it was learned."""
    found = learned(folder)
    error = found["error_percent"]
    assert error["held_out"]["with"] < 0.8 * error["held_out"]["without"]
    assert error["cross_validation"]["with"] < 0.95 * error["cross_validation"]["without"]
    for motor in found["motors"]:
        both = motor["cross_validation_percent"]
        assert motor["learned"] == (both["with"] < 0.99 * both["without"])
    inside = [joint["inside_interval_percent"] for joint in found["per_joint"].values()]
    assert 90 < np.mean(inside) <= 100
    said = (folder / "said.txt").read_text()
    assert f"relative torque error is {error['cross_validation']['with']:.2f} % instead of" in said
    assert f"wrote {folder / 'out' / 'learned_residual.npz'}" in said


def test_the_file_holds_what_the_results_say(folder: Path) -> None:
    found = read_learned_residual(folder / "out" / "learned_residual.npz", folder / "out" / "estimates.yaml")
    assert list(found.learned) == [m["motor"] for m in learned(folder)["motors"] if m["learned"]]
    mean, std = found.torque(np.zeros((2, 6)), np.ones((2, 6)), np.full((2, 6), 5.0))
    assert mean.shape == (2, 6) and np.all(mean[:, 0] != 0) and np.all(std > 0)


def test_the_report_shows_it(folder: Path) -> None:
    page = (folder / "out" / "report.html").read_text("utf-8")
    assert 'id="table-learned-motors"' in page and 'id="table-learned-joints"' in page
    assert main(["report", str(folder / "out")]) == 0
    assert 'id="table-learned-motors"' in (folder / "out" / "report.html").read_text("utf-8")


@pytest.mark.slow
def test_the_unseen_part_is_not_looked_at(folder: Path, tmp_path: Path) -> None:
    other = copied(folder, tmp_path / "other")
    log = pl.read_parquet(other / "exciting.parquet")
    late = pl.col("t") >= 0.7 * 45000 / 5000
    names = [f"torque_{i}" for i in range(1, 7)]
    log.with_columns(pl.when(late).then(-pl.col(n)).otherwise(pl.col(n)) for n in names).write_parquet(
        other / "exciting.parquet"
    )
    assert main(arguments(other, "--learn-residual")) == 0
    assert learned(other)["motors"] == learned(folder)["motors"]
    files = [f / "out" / "learned_residual.npz" for f in (other, folder)]
    with np.load(files[0]) as one, np.load(files[1]) as two:
        for name in one.files:
            np.testing.assert_array_equal(one[name], two[name])


def test_everything_else_is_as_without(folder: Path, tmp_path: Path) -> None:
    """Estimates to the last digit; and the file of an earlier run goes with them."""
    other = copied(folder, tmp_path / "other")
    before = json.loads((other / "out" / "results.json").read_text())
    assert main(arguments(other)) == 0
    after = json.loads((other / "out" / "results.json").read_text())
    for key in ("parameters", "error_percent", "base_parameters", "essential_parameters", "remarks"):
        assert after[key] == before[key]
    assert after["learned_residual"] is None
    assert not (other / "out" / "learned_residual.npz").exists()


def test_without_scikit_learn(
    examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One sentence, before anything is read or written."""
    monkeypatch.setitem(sys.modules, "sklearn", None)
    folder = copied(examples / "tx40", tmp_path / "tx40")
    assert main(arguments(folder, "--learn-residual")) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert_refusal(said, "E-DYN-027")
    assert not (folder / "out").exists()


def test_elastic_joints_are_refused(
    examples: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("sklearn", reason="scikit-learn (the extra 'learn') is not installed")
    folder = copied(examples / "tx40", tmp_path / "tx40")
    assert main(arguments(folder, "--learn-residual", "--flexible")) == 2
    assert_refusal(capsys.readouterr().err, "E-RUN-034")
