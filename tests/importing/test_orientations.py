"""Conventions of measured orientations, told by the nominal robot: a stranger's arm, his ways to write an orientation, his errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from stranger_cell import (
    Cell,
    fixed_xyz,
    kuka_abc,
    quaternion,
    rotation_vector,
    turned_xyz,
    turned_yxz,
    turned_zxz,
    turned_zyz,
)

from flexcal.errors import InputError
from flexcal.jobs.setup import ImportedFile, import_file
from flexcal.model.parts import wxyz_rotation

Written = Callable[[np.ndarray], np.ndarray]
WAYS: list[tuple[str, Written, bool, str]] = [
    ("rx,ry,rz", fixed_xyz, True, "xyz-extrinsic"),
    ("RX,RY,RZ", turned_xyz, True, "xyz-intrinsic"),
    ("Rx[deg],Ry[deg],Rz[deg]", turned_yxz, True, "yxz-intrinsic"),
    ("A,B,C", kuka_abc, True, "zyx-intrinsic"),
    ("W,P,R", fixed_xyz, True, "xyz-extrinsic"),
    ("roll,pitch,yaw", fixed_xyz, False, "xyz-extrinsic"),
    ("O,A,T", turned_zyz, True, "zyz-intrinsic"),
    ("phi,theta,psi", turned_zxz, False, "zxz-intrinsic"),
    ("rx,ry,rz", rotation_vector, False, "rotation-vector"),
    ("rx,ry,rz", rotation_vector, True, "rotation-vector"),
    ("qw,qx,qy,qz", quaternion, False, "wxyz"),
    ("q1,q2,q3,q4", lambda m: quaternion(m)[[1, 2, 3, 0]], False, "xyzw"),
    ("q0,q1,q2,q3", lambda m: 0.7 * quaternion(m), False, "wxyz"),
    ("rx,ry,rz", lambda m: fixed_xyz(m.T), True, "xyz-extrinsic-transposed"),
    ("qw,qx,qy,qz", lambda m: quaternion(m.T), False, "wxyz-transposed"),
]


def imported(folder: Path, cell: Cell, names: str, numbers: np.ndarray, **options) -> ImportedFile:
    file = folder / "measured.csv"
    file.write_text(cell.table(names, numbers))
    return import_file(cell.arm.write(folder), file, out=folder / "poses.csv", **options)


@pytest.mark.parametrize("way", range(len(WAYS)))
@pytest.mark.parametrize(("joints", "poses"), [(6, 6), (7, 40)])
def test_the_convention_is_told_by_the_robot(tmp_path: Path, way: int, joints: int, poses: int) -> None:
    names, write, degrees, option = WAYS[way]
    cell = Cell.measured(joints, poses, 100 * way + joints, travel=0.5)
    numbers = np.array([write(frame) for frame in cell.frames])
    outcome = imported(tmp_path, cell, names, np.rad2deg(numbers) if degrees else numbers)
    turned = outcome.orientations
    assert turned is not None and turned.convention.option == option and outcome.out is not None
    assert turned.compared is not None and turned.compared.best.rms < np.deg2rad(0.6)
    wxyz = np.stack([outcome.columns[name] for name in ("qw", "qx", "qy", "qz")], axis=1)
    np.testing.assert_allclose(np.linalg.norm(wxyz, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(wxyz_rotation(wxyz), cell.frames, atol=5e-5)
    assert any(f"{turned.convention.words}: 0." in remark for remark in outcome.remarks)


def refused(folder: Path, cell: Cell, names: str, numbers: np.ndarray, **options) -> InputError:
    with pytest.raises(InputError) as error:
        imported(folder, cell, names, numbers, **options)
    assert not (folder / "poses.csv").exists()
    return error.value


def test_what_is_refused_and_why(tmp_path: Path) -> None:
    cell = Cell.measured(6, 30, 5, travel=0.5)
    angles = np.rad2deg([fixed_xyz(frame) for frame in cell.frames])
    mixed = angles.copy()
    mixed[20:25] = np.rad2deg([turned_xyz(frame) for frame in cell.frames[20:25]])
    error = refused(tmp_path, cell, "rx,ry,rz", mixed)
    assert error.code == "E-IMPORT-066" and "line 22" in str(error) and "turned axes" in str(error)
    wrong = angles.copy()
    wrong[4] += [30.0, 10.0, 0.0]
    assert refused(tmp_path, cell, "rx,ry,rz", wrong).code == "E-IMPORT-067"
    shuffled = np.random.default_rng(1).permutation(angles)
    assert refused(tmp_path, cell, "rx,ry,rz", shuffled).code == "E-IMPORT-064"
    error = refused(tmp_path, cell, "rx,ry,rz", angles, orientation="xyz-intrinsic")
    assert error.code == "E-IMPORT-065" and "--orientation xyz-extrinsic" in str(error)
    error = refused(tmp_path, cell, "rz,ry,rx", angles)
    assert error.code == "E-IMPORT-063" and "--map 'angle1=" in str(error)
    norms = np.array([quaternion(frame) for frame in cell.frames])
    norms[7] *= 0.7
    error = refused(tmp_path, cell, "qw,qx,qy,qz", norms)
    assert error.code == "E-IMPORT-059" and "line 9" in str(error)


def test_few_poses_need_the_option(tmp_path: Path) -> None:
    cell = Cell.measured(6, 5, 8)
    angles = np.rad2deg([kuka_abc(frame) for frame in cell.frames])
    assert refused(tmp_path, cell, "A,B,C", angles).code == "E-IMPORT-060"
    outcome = imported(tmp_path, cell, "A[deg],B[deg],C[deg]", angles, orientation="zyx-intrinsic")
    assert outcome.orientations is not None and outcome.orientations.compared is None
    np.testing.assert_allclose(outcome.orientations.rotations, cell.frames, atol=5e-5)
