"""Turn the published UR5 laser-tracker CSV files into flexcal's pose format; run once, the results are kept beside it.

    python convert.py FOLDER        # FOLDER holds grid.csv and random.csv, the two files of the UR5 data set as published

Published columns: step_order; x_t, y_t, z_t = target and x_dif, y_dif, z_dif = error, in mm, in the robot's own
base frame; joint_1 ... joint_6 = commanded joint angles in degrees.
Written columns: pose (= step_order, the measuring order), q1 ... q6 in rad, x, y, z = measured point in m.

The sign of the error is documented only as "the difference between the target position and the actual achieved
position". Assumed here: dif = actual - target, so actual = target + dif. The digits say so: each of the 3060 sums
target + dif is a whole number of nanometres (the tracker's output), which neither the targets nor the differences
target - dif are. The script refuses data for which this does not hold.
"""

import csv
import sys
from math import radians
from pathlib import Path

FILES = ("grid.csv", "random.csv")
HEADER = ("pose", "q1", "q2", "q3", "q4", "q5", "q6", "x", "y", "z")
DIGITS = 6  # decimals of a millimetre in the tracker's output
ROUNDING = 1e-9  # mm, far above double rounding and far below 10^-DIGITS


def measured_millimetres(row: dict[str, str], axis: str) -> float:
    """Measured coordinate in mm: target + dif, checked to be a number the tracker can have written."""
    value = float(row[f"{axis}_t"]) + float(row[f"{axis}_dif"])
    if abs(value - round(value, DIGITS)) > ROUNDING:
        reading = f"step_order {row['step_order']}: {axis}_t + {axis}_dif = {value!r} mm"
        raise SystemExit(f"{reading} is no tracker reading: is the sign of dif reversed?")
    return value


def convert(row: dict[str, str]) -> list[str]:
    """One published row in flexcal's pose format."""
    joints = [f"{radians(float(row[f'joint_{number}'])):.12f}" for number in range(1, 7)]
    point = [f"{measured_millimetres(row, axis) * 1e-3:.9f}" for axis in "xyz"]
    return [str(int(row["step_order"])), *joints, *point]


def main(source: Path, target: Path) -> None:
    for name in FILES:
        with open(source / name, newline="") as published, open(target / name, "w", newline="") as converted:
            writer = csv.writer(converted, lineterminator="\n")
            writer.writerow(HEADER)
            rows = [convert(row) for row in csv.DictReader(published)]
            writer.writerows(rows)
        print(f"{name}: {len(rows)} poses")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), Path(__file__).parent)
