"""Measurements of the arm in the formats of other programs: Excel, MAT-files, Parquet, universal files and ROS recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

_JOINTS = "sensor_msgs/msg/JointState"


def write_foreign(folder: Path, columns: dict[str, np.ndarray], log: dict[str, np.ndarray]) -> None:
    """`columns` of measured poses and of a `log`, where the packages for a format are there, as files named measured, recorded."""
    pl.DataFrame(columns).write_parquet(folder / "measured.parquet")
    _write_mat(folder, columns)
    _write_excel(folder, columns)
    write_recordings(folder, log)


def write_recordings(folder: Path, log: dict[str, np.ndarray]) -> None:
    """Universal files and recordings of ROS of a log: t (N,), q and tau (N, 3)."""
    _write_universal(folder, log)
    _write_bags(folder, log)
    _write_bag_of_ros_1(folder, log)


def _write_mat(folder: Path, columns: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(folder / "measured.mat", {"data": columns})
    try:
        import h5py
    except ImportError:
        return
    path = folder / "measured_hdf5.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file[name] = values[None]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def _write_excel(folder: Path, columns: dict[str, np.ndarray]) -> None:
    try:
        import openpyxl
    except ImportError:
        return
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(list(columns))
    for row in zip(*columns.values(), strict=True):
        sheet.append([float(value) for value in row])
    book.save(folder / "measured.xlsx")


def _write_universal(folder: Path, log: dict[str, np.ndarray]) -> None:
    """Data sets 58 of text, and of binary numbers, their headers as in the I-DEAS manual."""
    histories = [("q", log["q"]), ("tau", log["tau"])]
    named = [(f"{quantity}{k + 1}", values[:, k]) for quantity, values in histories for k in range(3)]
    step = log["t"][1] - log["t"][0]
    for name, binary in (("measured.uff", False), ("measured_binary.uff", True)):
        (folder / name).write_bytes(
            b"".join(_history(label, step, values, binary) for label, values in named)
        )


def _history(name: str, step: float, values: np.ndarray, binary: bool) -> bytes:
    numbers = values.astype("<f8").tobytes()
    lines = [
        "    -1",
        f"    58b     1     2          11{len(numbers):10d}     0     0           0           0"
        if binary
        else "    58",
        *(name, "NONE", "23-Nov-26 10:00:00", "NONE", "NONE"),
        "    1         0    0         0 NONE               1   3 NONE               0   0",
        f"         4{len(values):10d}         1{0.0:13.5e}{step:13.5e}{0.0:13.5e}",
        "        17    0    0    0 Time                 s",
        "         8    0    0    0 Angle                rad",
        *["         0    0    0    0 NONE                 NONE"] * 2,
    ]
    text = "\n".join(lines).encode() + b"\n"
    if binary:
        return text + numbers + b"\n    -1\n"
    cells = [f"{value:20.11e}" for value in values]
    rows = ["".join(cells[k : k + 4]) for k in range(0, len(cells), 4)]
    return text + "\n".join([*rows, "    -1"]).encode() + b"\n"


def _write_bags(folder: Path, log: dict[str, np.ndarray]) -> None:
    """Folders bag_mcap and bag_db3, and their storages alone, with joint states and a measured point."""
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        return
    store = get_typestore(Stores.ROS2_HUMBLE)
    for plugin, ending in ((StoragePlugin.MCAP, "mcap"), (StoragePlugin.SQLITE3, "db3")):
        bag = folder / f"bag_{ending}"
        with Writer(bag, version=9, storage_plugin=plugin) as writer:
            topic = writer.add_connection("/joint_states", _JOINTS, typestore=store)
            for received, message in _messages(store.types, log):
                writer.write(topic, received, store.serialize_cdr(message, _JOINTS))
        storage = next(bag.glob(f"*.{ending}"))
        (folder / f"recorded.{ending}").write_bytes(storage.read_bytes())


def _write_bag_of_ros_1(folder: Path, log: dict[str, np.ndarray]) -> None:
    try:
        from rosbags.rosbag1 import Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        return
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(folder / "recorded.bag") as writer:
        topic = writer.add_connection("/joint_states", _JOINTS, typestore=store)
        for received, message in _messages(store.types, log, seq=0):
            writer.write(topic, received, store.serialize_ros1(message, _JOINTS))


def _messages(
    types: Mapping[str, Any], log: dict[str, np.ndarray], **header: int
) -> Iterator[tuple[int, Any]]:
    """Joint states, and when they were received, ns."""
    names = [f"axis_{i + 1}" for i in range(3)]
    for t, q, tau in zip(log["t"], log["q"], log["tau"], strict=True):
        stamp = types["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round(t % 1 * 1e9))
        place = types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **header)
        yield (
            round((t + 0.004) * 1e9),
            types[_JOINTS](header=place, name=names, position=q, velocity=0 * q, effort=tau),
        )
