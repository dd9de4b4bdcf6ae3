"""Files of joint positions at which a ball on the tool sits in the sockets of a fixture: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import first_point, payload_column, target_column, whole_numbers
from flexcal.data.poses.pose_set import DEFAULT_SIGMA, PoseSet
from flexcal.data.tables import TableFile, assign, check_joint_units
from flexcal.files.structuring import suggestion

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel, SocketsConfig

SOCKET_COLUMNS = ("fixture", "socket")


def measures_sockets(file: TableFile) -> bool:
    """Whether a file has the columns `fixture` and `socket`."""
    return set(SOCKET_COLUMNS) <= set(file.columns)


def read_sockets(file: TableFile, model: RobotModel, further: Sequence[str] = ()) -> PoseSet:
    """Read rows of `fixture`, `socket` and q1…qn; optional are `pose`, `target`, `payload` and `tau1`…, and
    the `further` columns, which are not used.

    `fixture` is any name of the place where the fixture stood, `socket` a name under `measurements:` of robot.yaml. Raises `InputError`
    where robot.yaml declares no sockets, for an unknown socket, for places whose names differ only in capital letters, and for a place
    that is called as a station of an instrument.
    """
    declared = _declared(file, model)
    texts = (*SOCKET_COLUMNS, *(name for name in ("target", *further) if name in file.columns))
    texts = tuple(dict.fromkeys(texts))
    signals = assign(file, model, ("q",), ("pose", "tau", "payload"), texts)
    table = file.read(texts)
    values = {name: signal.values(table) for name, signal in signals.items()}
    check_joint_units(model, table, signals["q"], values["q"])
    fixture, socket = (table.columns[name] for name in SOCKET_COLUMNS)
    rows = len(table)
    for row, name in enumerate(socket.tolist()):
        if name not in declared.sockets:
            known = list(declared.sockets)
            hint = suggestion(name, known) or f"; known are {', '.join(known)}."
            raise table.error(
                "E-POSES-037", row, "socket", f"there is no socket '{name}' in robot.yaml{hint}"
            )
    spelt: dict[str, str] = {}
    for row, name in enumerate(fixture.tolist()):
        if (first := spelt.setdefault(name.casefold(), name)) != name:
            raise table.error(
                "E-POSES-063",
                row,
                "fixture",
                f"the places '{first}' and '{name}' differ only in capital letters; give one place one name.",
            )
        if name in model.config.stations:
            raise table.error(
                "E-POSES-038",
                row,
                "fixture",
                f"'{name}' is a station of the instrument; give the place another name.",
            )
    pose = (
        whole_numbers(table, signals["pose"].columns[0], values["pose"][:, 0])
        if "pose" in values
        else np.arange(1, rows + 1)
    )
    return PoseSet(
        q=values["q"],
        position=np.array([declared.sockets[name] for name in socket.tolist()]).reshape(-1, 3),
        sigma=np.full((rows, 3), DEFAULT_SIGMA),
        torque=values.get("tau"),
        payload=payload_column(table, signals, model),
        target=target_column(table, model) if "target" in texts else np.full(rows, first_point(file, model)),
        station=fixture,
        temperature=None,
        pose=pose,
        socket=socket,
        sigma_given=False,
    )


def _declared(file: TableFile, model: RobotModel) -> SocketsConfig:
    sockets = [item for item in model.config.measurements.values() if item.kind == "sockets"]
    if not sockets:
        raise file.error(
            "E-POSES-039",
            "there are columns 'fixture' and 'socket', but robot.yaml declares no sockets; add "
            "`measurements: {fixture: {kind: sockets, sockets: {a: [0, 0, 0], b: [0.05, 0, 0]}}}` with their positions in m.",
        )
    if len(sockets) > 1:
        raise file.error(
            "E-POSES-040", "robot.yaml declares several fixtures under `measurements:`; keep one."
        )
    return sockets[0]
