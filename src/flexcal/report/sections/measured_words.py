"""Words for what was measured, in tables and captions."""

from __future__ import annotations

from dataclasses import dataclass

from flexcal.calibration.verification import DECLARED, NOMINAL, OWN
from flexcal.data.poses import PoseSet


@dataclass(frozen=True)
class MeasuredWords:
    """What the rows of a set of measurements are called, `rows`, and what else depends on how they were measured.

    `distance` is what an error is, `arrow` from where to where its arrow points, `frame` where errors have their coordinates, `drift` the
    cause of residuals that drift. `before` are labels of the uncalibrated robot by its name, with a `note` on them; errors
    are `against` something and have its `noise`.
    """

    rows: str
    distance: str
    arrow: str
    frame: str
    drift: str
    placed: str
    before: dict[str, str]
    note: str
    against: str
    noise: str

    @classmethod
    def of(cls, poses: PoseSet) -> MeasuredWords:
        """The words for measured points, or for a ball in sockets where that is all that there is."""
        return _SOCKETS if len(poses) and poses.in_socket.all() else POINTS


POINTS = MeasuredWords(
    rows="points",
    distance="Distance between measured and predicted point",
    arrow="from the predicted to the measured point",
    frame="the instrument's frame",
    drift="warm-up or a moving instrument, a step a collision",
    placed="with instrument and measured point registered by best fit",
    before={
        DECLARED: "before, as declared",
        NOMINAL: "before, best-fit registered",
        OWN: "before, the robot's own (registered, point found too)",
    },
    note="As declared: with the measured point where robot.yaml says, in the declared frame; a dash where the instrument measures in "
    "a frame of its own. Best-fit registered: with the instrument's frame fitted (6 parameters a station). The robot's own: with the place "
    "of the measured point on the tool fitted too (3 a point), because an error of its declared place is not one of the robot.",
    against="the instrument",
    noise="the instrument's noise",
)
_SOCKETS = MeasuredWords(
    rows="poses",
    distance="Distance of the ball, as predicted, from its socket",
    arrow="from the predicted position of the ball to its socket",
    frame="the robot's base frame",
    drift="an arm that warms up or a fixture that gives way",
    placed="with the places of the fixture and the ball found by best fit",
    before={
        NOMINAL: "before, sockets placed by best fit",
        OWN: "before, the robot's own (ball on the tool found too)",
    },
    note="Where the sockets stood is not measured. Placed by best fit: the fixture at each of its places, or outside the fit each socket "
    "by itself, as it fits the nominal robot best. The robot's own: with the place of the ball on the tool fitted too, because an error of "
    "its declared place is not one of the robot.",
    against="the sockets",
    noise="the play of the ball in its socket",
)
