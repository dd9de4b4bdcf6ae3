"""Numbers and archives from elsewhere are bounded where they are read, so that nothing overflows or is missing later."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest
from fleet_files import write_calibration, write_robot

from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import read_json, write_yaml
from flexcal.files.formats.npz_reader import ArrayForm, NpzFile
from flexcal.importing.readers import read_foreign
from flexcal.jobs.fleet.prior import write_prior
from flexcal.jobs.fleet_prior.kinematics import nominal_joints
from flexcal.jobs.fleet_prior.prior_file import StoredParameter, StoredPrior, read_model_prior
from flexcal.model.robot import RobotModel


@pytest.mark.parametrize("number", ["1e999", "-1e300", "9" * 400, "9" * 5000, "NaN", "-Infinity"])
def test_json(number: str, tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(f'{{"a": [1, 2.5, {number}]}}')
    with pytest.raises(InputError, match=r"results\.json.*; run it again\.") as caught:
        read_json(path, "run it again")
    assert len(str(caught.value)) < 200 + len(str(path))
    path.write_text('{"a": [1, -2.5, 340282366920938463463374607431768211455]}')
    assert read_json(path, "")["a"] == [1, -2.5, 2**128 - 1]


@pytest.mark.parametrize(
    "header",
    ["{'descr': '<f8', 'shape': (", "{'descr': '<f8', 'fortran_order': False, 'shape': (10L,)}", "("],
)
def test_npz(header: str, tmp_path: Path) -> None:
    """Headers that are no Python, or of Python 2."""
    text = header.encode().ljust(117) + b"\n"
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(80))
    with pytest.raises(InputError, match=r"a\.npz cannot be read .*; run it again\."):
        NpzFile(tmp_path / "a.npz", "run it again").read({"a": ArrayForm("real", ("n",))})


def test_an_excel_file_without_sheets(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("fastexcel")
    content = io.BytesIO()
    openpyxl.Workbook().save(content)
    with zipfile.ZipFile(content) as book, zipfile.ZipFile(tmp_path / "a.xlsx", "w") as broken:
        for name in book.namelist():
            part = book.read(name)
            if name == "xl/workbook.xml":
                begin, end = part.index(b"<sheets>"), part.index(b"</sheets>")
                part = part[: begin + 8] + part[end:]
            broken.writestr(name, part)
    with pytest.raises(InputError, match=r"a\.xlsx has no sheet"):
        read_foreign(tmp_path / "a.xlsx", ())


@pytest.mark.parametrize("points", ["", "points: {smr: {frame: arm, xyz: [0.1, 0.2, 0.3]}}\n"])
def test_a_fleet_of_which_only_the_base_is_known(points: str, tmp_path: Path) -> None:
    """There is nothing to pool, with and without points, and that is said."""
    for k in range(4):
        folder = tmp_path / f"fleet/{k}"
        urdf = write_robot(folder, serial=f"S{k}")
        with (folder / "robot.yaml").open("a") as robot:
            robot.write(points)
        write_calibration(folder / "2026-01-05", {"j1.offset": (1e-3 * k, 1e-4)}, data=str(k), urdf=urdf)
    with pytest.raises(FlexcalError, match="tell nothing of the robots"):
        write_prior(tmp_path / "fleet", tmp_path / "prior.yaml")


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("mean_std: 0.0001", "mean_std: 1.0e-308", "E-PRIOR-006"),
        ("spread: 0.001", "spread: 9223372036854775808", "E-PRIOR-021"),
    ],
)
def test_a_prior_that_cannot_be(old: str, new: str, code: str, tmp_path: Path) -> None:
    write_robot(tmp_path)
    model = RobotModel.from_yaml(tmp_path / "robot.yaml", estimates=False)
    entry = StoredParameter(0.0, "rad", 1e-3, 1e-4, 1e-3, 5.0)
    prior = tmp_path / "prior.yaml"
    write_yaml(
        prior,
        StoredPrior(model.name, ("a",), ("kinematic",), nominal_joints(model), {"j1.offset": entry}, ()),
    )
    assert read_model_prior(prior, model).geometry is not None
    changed = prior.read_text().replace(old, new)
    assert changed != prior.read_text()
    prior.write_text(changed)
    with pytest.raises(InputError, match=r"prior\.yaml line") as caught:
        read_model_prior(prior, model)
    assert caught.value.code == code
