"""The customer's version: two sheets with what was given, before and after, and the same verdict as the report."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from headless import CHROMIUM
from outline import Outline
from waiting import PATIENCE

from flexcal.cli.main import main
from flexcal.jobs.pages import customer_report
from flexcal.jobs.result_files import read_results
from flexcal.report.pages.customer import uncertainty_rows
from flexcal.report.results import MeasurementDetails

GIVEN = MeasurementDetails(
    robot_serial="R-17", instrument="tracker T", instrument_serial="T-9", operator="A. Meier"
)


@pytest.fixture(scope="module")
def folders(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A UR5 calibrated on 150 poses of its grid in `fit`, verified on its random poses in `check`."""
    home = tmp_path_factory.mktemp("customer")
    for file in ("robot.yaml", "ur5.urdf", "random.csv"):
        shutil.copy(examples / "ur5_tracker" / file, home)
    header, *rows = (examples / "ur5_tracker" / "grid.csv").read_text().splitlines()
    (home / "some.csv").write_text("\n".join([header, *rows[::7]]))
    robot, fit = str(home / "robot.yaml"), str(home / "fit")
    assert main(["calibrate", robot, str(home / "some.csv"), "--terms", "kinematic", "--out", fit]) == 0
    more = ["--estimates", fit, "--out", str(home / "check")]
    assert main(["verify", robot, str(home / "random.csv"), *more]) == 0
    return home


@pytest.mark.parametrize("folder", ["fit", "check"])
def test_sheets_have_what_was_given_and_found(folders: Path, folder: str, tmp_path: Path) -> None:
    page = customer_report(folders / folder, GIVEN)
    text = page.read_text("utf-8")
    outline, results = Outline(text), read_results(folders / folder)
    words = outline.words
    assert outline.unbalanced == [] and "<script" not in text and "http" not in text
    assert all(word in words for word in ("R-17", "tracker T", "T-9", "A. Meier"))
    assert len(re.findall('class="blank"', text)) == 1
    after = results["verification"]["measured"] if folder == "check" else results["calibration"]["selected"]
    assert f"{after['p90_mm']:.3f}" in words and f"{results['before']['own']['p90_mm']:.3f}" in words
    assert results["verdict"]["trusted"] is (True if folder == "check" else None)
    assert ("Cannot be judged" in words) is (folder != "check")
    assert "seed" not in words and "paper" not in words
    if CHROMIUM is not None:
        sheets = tmp_path / "sheets.pdf"
        flags = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
        subprocess.run(
            [CHROMIUM, *flags, f"--print-to-pdf={sheets}", page.as_uri()], check=True, capture_output=True, timeout=PATIENCE
        )  # fmt: skip
        assert len(re.findall(rb"/Type /Page\b", sheets.read_bytes())) == 2


def test_error_budget_is_shown_where_it_is_known() -> None:
    rows = uncertainty_rows(
        {"variances": {"instrument_mm": 0.02, "robot_mm": 0.05, "model_mm": None}, "fit": {"sigma_mm": 0.06}}
    )
    assert [value for _, value in rows] == ["0.020 mm", "0.050 mm", "0.060 mm"]


def test_what_has_no_customer_version(folders: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(folders / "fit"), "--operator", "A"]) == 2
    assert "--customer" in capsys.readouterr().err
    assert main(["report", str(folders / "fit"), "--customer", "--compare", str(folders / "check")]) == 2
    (folders / "other").mkdir()
    (folders / "other" / "results.json").write_text('{"kind": "stiffness", "schema": 1, "robot": "r"}')
    assert main(["report", str(folders / "other"), "--customer"]) == 2
    assert "no calibration or verification" in capsys.readouterr().err
