"""Files of joint positions at which a ball on the tool sits in the sockets of a fixture: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import (
    approach_columns,
    first_point,
    payload_column,
    target_column,
    whole_numbers,
)
from flexcal.data.poses.pose_set import DEFAULT_SIGMA, PoseSet
from flexcal.data.tables import Table, TableFile, assign, check_joint_units
from flexcal.files.structuring import suggestion

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel, SocketsConfig

SOCKET_COLUMNS = ("fixture", "socket")
HOLDER = "holder"
"""Column with the name of a fixture under `measurements:`, where several have a socket of one name."""


def measures_sockets(file: TableFile) -> bool:
    """Whether a file has the columns `fixture` and `socket`."""
    return set(SOCKET_COLUMNS) <= set(file.columns)


def read_sockets(file: TableFile, model: RobotModel, further: Sequence[str] = ()) -> PoseSet:
    """Read rows of `fixture`, `socket` and q1…qn; optional are `holder`, `pose`, `target`, `payload`, `tau1`… and `approach1`…, and
    the `further` columns, which are not used.

    `fixture` is any name of the place where the fixture stood, `socket` a name under `measurements:` of robot.yaml, `holder` that of
    its fixture there. Raises `InputError` where robot.yaml declares no sockets, for an unknown socket and one that several fixtures have,
    for several fixtures at one place, for places whose names differ only in capital letters, and for a place that is called as a station
    of an instrument.
    """
    declared = _declared(file, model)
    texts = (*SOCKET_COLUMNS, *(name for name in (HOLDER, "target", *further) if name in file.columns))
    texts = tuple(dict.fromkeys(texts))
    signals = assign(file, model, ("q",), ("pose", "tau", "payload", "approach"), texts)
    table = file.read(texts)
    values = {name: signal.values(table) for name, signal in signals.items()}
    check_joint_units(model, table, signals["q"], values["q"])
    fixture, socket = (table.columns[name] for name in SOCKET_COLUMNS)
    rows = len(table)
    holder = _holders(table, declared, fixture)
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
        position=np.array(
            [declared[name].sockets[own] for name, own in zip(holder.tolist(), socket.tolist(), strict=True)]
        ).reshape(-1, 3),
        sigma=np.full((rows, 3), DEFAULT_SIGMA),
        torque=values.get("tau"),
        payload=payload_column(table, signals, model),
        target=target_column(table, model) if "target" in texts else np.full(rows, first_point(file, model)),
        station=fixture,
        temperature=None,
        pose=pose,
        socket=socket,
        holder=holder,
        approach=approach_columns(table, signals),
        sigma_given=False,
    )


def _holders(table: Table, declared: Mapping[str, SocketsConfig], fixture: np.ndarray) -> np.ndarray:
    """Names (N,) of the declared fixtures whose sockets the rows name."""
    socket, at_place = table.columns["socket"], {}
    named = table.columns[HOLDER].tolist() if HOLDER in table.columns else [""] * len(table)
    holders = []
    for row, (name, own) in enumerate(zip(named, socket.tolist(), strict=True)):
        if name and name not in declared:
            hint = suggestion(name, list(declared)) or f"; known are {', '.join(declared)}."
            raise table.error("E-POSES-040", row, HOLDER, f"robot.yaml declares no sockets '{name}'{hint}")
        among = [key for key in ([name] if name else declared) if own in declared[key].sockets]
        if not among:
            known = [one for key in ([name] if name else declared) for one in declared[key].sockets]
            hint = suggestion(own, known) or f"; known are {', '.join(dict.fromkeys(known))}."
            raise table.error("E-POSES-037", row, "socket", f"there is no socket '{own}' in robot.yaml{hint}")
        if len(among) > 1:
            raise table.error(
                "E-POSES-075",
                row,
                "socket",
                f"{' and '.join(among)} both have a socket '{own}'; add a column '{HOLDER}' with the name of the fixture, or give the "
                "sockets names of their own in robot.yaml.",
            )
        place = str(fixture[row])
        if at_place.setdefault(place, among[0]) != among[0]:
            raise table.error(
                "E-POSES-076",
                row,
                "fixture",
                f"'{place}' is a place of {at_place[place]}, and here of {among[0]}; give every place of each fixture a name of its own.",
            )
        holders.append(among[0])
    return np.array(holders, dtype=str)


def _declared(file: TableFile, model: RobotModel) -> dict[str, SocketsConfig]:
    """Fixtures with sockets by name."""
    sockets = {name: item for name, item in model.config.measurements.items() if item.kind == "sockets"}
    if not sockets:
        raise file.error(
            "E-POSES-039",
            "there are columns 'fixture' and 'socket', but robot.yaml declares no sockets; add "
            "`measurements: {fixture: {kind: sockets, sockets: {a: [0, 0, 0], b: [0.05, 0, 0]}}}` with their positions in m.",
        )
    return sockets
