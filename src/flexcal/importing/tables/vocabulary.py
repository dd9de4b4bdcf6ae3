"""Words used in column names."""

from __future__ import annotations


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


JOINT = _words("q j joint joints axis axes ax theta th θ jnt angle angles achse achsen gelenk gelenke winkel")
JOINT |= _words(
    "axe articulation articulations eje ejes articulacion asse assi giunto giunti eixo eixos junta juntas"
)
JOINT |= _words("os gewricht ось оси 軸 轴 軸角度 轴角度 关节 關節 関節 关节角 关节角度 関節角度 축 관절")
"""Of joint positions, whatever stands beside them; the others of `POSITION` are so only with one of these, or a joint's name."""
POSITION = JOINT | _words(
    "a lage weg hub stroke position positions pos posicion posicao posizione state states value values encoder"
)
CARTESIAN = _words("tcp cartesian")
"""Words of the tool, which exclude joints."""
NO_JOINT = _words("pose error err dev deviation force voltage limit mode offset digital analog")
NO_JOINT |= _words("residual correction delta status")
KINDS = (
    ("ddq", _words("ddq qdd acceleration accelerations acc accel beschleunigung")),
    (
        "dq",
        _words(
            "dq qd velocity velocities vel speed qdot rate vitesse velocidad velocidade velocita geschwindigkeit drehzahl"
        ),
    ),
    ("tau", _words("tau τ torque torques effort efforts moment drehmoment couple coppia par")),
    ("current", _words("current currents i iq strom amp amps")),
    ("q", POSITION),
)
"""Words of quantities with one column per joint, the most specific first."""
FORCE = _words("force forces kraft fuerza forza forca effort")
"""Words of the force of a prismatic joint; elsewhere of a sensor."""
SLIDING = ("N", "m/s", "mm/s", "m/s^2", "mm/s^2")
"""Units of prismatic joints only."""
MEASURED = _words(
    "actual act ist measured meas feedback fb tracker lt smr mesure mesuree medido medida misurato misurata"
)
COMMANDED = _words(
    "target desired des soll cmd command commanded ref reference nominal nom setpoint consigne"
)
NEUTRAL = MEASURED | COMMANDED | _words("robot arm motor link the of in")
POINT = {"x": "x", "y": "y", "z": "z", "px": "x", "py": "y", "pz": "z"}
BASE = _words("base basis platform cart agv chassis")
"""Of the measured pose of a base that moves."""
TILT = _words("tilt tilts inclination inclinometer incl neigung level niveau")
"""Of the readings of an inclinometer."""
NO_POINT = _words("force f error err deviation dev delta normal velocity vel v speed acc offset rpy")
TURN = _words("orientation quaternion quat rotation rot")
SIGMA = _words("sigma σ std sd uncertainty stddev")
SINGLE = {
    "t": _words("t time timestamp stamp datetime zeit zeitstempel uhrzeit seconds secs temps tiempo tempo"),
    "pose": _words(
        "pose poses no nr id number index idx measurement point punkt punktnr messpunkt nummer lfd sample row punto ponto"
    ),
    "payload": _words("payload load"),
    "temperature": _words("temperature temp temperatur"),
    "length": _words("length wire distance"),
    "sigma": SIGMA,
}
"""Quantities with one column."""


def rank(words: tuple[str, ...]) -> int:
    """Rank of a column: measured before plain before commanded."""
    if set(words) & MEASURED:
        return 0
    return 2 if set(words) & COMMANDED else 1
