"""Make exciting.parquet, tx40.urdf and the two matrices from the published files (thanhndv212/figaroh-examples, examples/staubli_tx40).

Run as: python convert.py FOLDER, with pos_read_data.csv, curr_data.csv and tx40_mdh_modified.urdf in FOLDER. Numbers are copied as they
are; t is the row number at 5 kHz; the URDF loses its meshes and materials.
"""

import re
import sys
from pathlib import Path

import numpy as np
import polars as pl

RATE_HZ = 5000.0
HERE = Path(__file__).parent


def convert(source: Path) -> None:
    """Write the four files beside this script."""
    position = (
        pl.read_csv(source / "pos_read_data.csv", infer_schema=False)
        .cast(pl.Float64)
        .rename(lambda name: name.replace("Joint", "motor"))
    )
    torque = (
        pl.read_csv(source / "curr_data.csv", infer_schema=False)
        .cast(pl.Float64)
        .rename(lambda name: name.replace("Joint", "torque"))
    )
    time = pl.DataFrame({"t": np.arange(len(position)) / RATE_HZ})
    pl.concat([time, position, torque], how="horizontal").write_parquet(
        HERE / "exciting.parquet", compression_level=19
    )

    urdf = (source / "tx40_mdh_modified.urdf").read_text(encoding="utf-8")
    urdf = re.sub(
        r"\s*<(visual|collision)>.*?</\1>|\s*<material .*?</material>|\s*<!--.*?-->",
        "",
        urdf,
        flags=re.DOTALL,
    )
    (HERE / "tx40.urdf").write_text(urdf, encoding="utf-8")

    motor_from_joint = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    motor_from_joint[5, 4] = 32.0  # the motor of axis 6 also turns with axis 5
    np.savetxt(
        HERE / "joint_from_motor.csv", np.linalg.inv(motor_from_joint) + 0.0, fmt="%.17g", delimiter=","
    )
    np.savetxt(HERE / "joint_from_motor_torque.csv", motor_from_joint.T, fmt="%.17g", delimiter=",")


if __name__ == "__main__":
    convert(Path(sys.argv[1]))
