"""Arguments that several verbs share."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Optional

from tyro.conf import Positional, arg
from tyro.constructors import PrimitiveConstructorSpec

from flexcal.errors import InputError

MaybePath = Optional[Path]  # noqa: UP045
MaybeText = Optional[str]  # noqa: UP045
MaybeNumber = Optional[float]  # noqa: UP045
MaybeCount = Optional[int]  # noqa: UP045
"""Of `Path | None` tyro would ask a type checker, which takes longer to load than some fits; not so of these, nor of `Paths` below."""
Robot = Annotated[Positional[Path], arg(metavar="ROBOT", help="robot.yaml")]


@dataclass(frozen=True)
class Between:
    """Note of an option whose number lies between two, which are allowed; checked for all verbs by `check_ranges`."""

    least: float
    most: float

    def includes(self, value: float) -> bool:
        """Whether a number lies in the range; NaN does not."""
        return self.least <= value <= self.most

    def __str__(self) -> str:
        return f"at least {self.least}" if self.most == math.inf else f"{self.least} to {self.most}"


def any_number(
    metavar: str, kind: Callable[[str], Any] = str, choices: tuple[str, ...] | None = None
) -> PrimitiveConstructorSpec:
    """Any number of values of a `kind`, or of the `choices`."""
    return PrimitiveConstructorSpec(
        nargs="*",
        metavar=metavar,
        choices=choices,
        instance_from_str=lambda texts: tuple(kind(text) for text in texts),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda values: [str(value) for value in values],
    )


def file_argument(metavar: str, text: str) -> Any:
    """Notes of a positional argument of one or several files."""
    return arg(metavar=metavar, help=text, help_behavior_hint="")


Paths = Annotated[tuple, any_number("FILE...", Path)]
Numbers = Annotated[tuple, any_number("X...", float)]
Texts = Annotated[tuple, any_number("TEXT...")]
PoseFiles = Annotated[
    Positional[Paths],
    file_argument("POSES...", "files of measured poses (CSV or Parquet), one or several"),
]


def _celsius(texts: list[str]) -> float:
    try:
        return float(texts[0])
    except ValueError:
        raise InputError(
            "E-CLI-047",
            f"--temperature is '{texts[0]}', but must be a number of °C, without a unit, as in --temperature 32.",
        ) from None


Temperature = Annotated[
    MaybeNumber,
    PrimitiveConstructorSpec(
        nargs=1,
        metavar="°C",
        instance_from_str=_celsius,
        is_instance=lambda value: value is None or isinstance(value, float),
        str_from_instance=lambda value: [str(value)],
    ),
    arg(
        metavar="°C",
        help="Temperature of the arm, °C, where no column 'temperature' says it.",
        help_behavior_hint="(default: that of the calibrated parameters)",
    ),
]
Estimates = Annotated[
    MaybePath,
    arg(
        metavar="FILE",
        help="estimates.yaml to use, or the folder that 'calibrate --out' wrote.",
        help_behavior_hint="(default: beside robot.yaml)",
    ),
]
Accept = Annotated[
    tuple,
    any_number("weight", choices=("weight",)),
    arg(
        metavar="weight",
        help="weight: go on where the torques do not hold the weight of the links, as of guessed masses or an arm that springs balance.",
        help_behavior_hint="",
    ),
]
On = Annotated[
    MaybeText,
    arg(
        metavar="ADDRESS",
        help="Dask scheduler whose workers compute, dask://host:port or tls://host:port; a cluster of your own, as it runs any code.",
        help_behavior_hint="(default: this machine)",
    ),
]
Seed = Annotated[int, arg(metavar="N"), Between(0, 2**63 - 1)]
PROCESS_COUNT = Between(1, 1000)
Processes = Annotated[int, arg(metavar="N", help="Number of processes on this machine."), PROCESS_COUNT]
Jobs = Annotated[
    int, arg(metavar="N", help="Number of logs read in parallel, each in its own process."), PROCESS_COUNT
]
Payload = Between(0, 1_000_000)
EstimatesFolder = Annotated[
    MaybePath,
    arg(
        metavar="DIR",
        help="Folder for report.html, results.json and estimates.yaml (then not beside robot.yaml); without it there is no report.",
        help_behavior_hint="(default: beside robot.yaml)",
    ),
]
Folder = Annotated[Path, arg(metavar="DIR")]
Json = Annotated[
    bool,
    arg(help="print one JSON document on standard output, and nothing else there", help_behavior_hint=""),
]


_NO_ROBOT = (".csv", ".parquet", ".npz", ".urdf", ".xml")


def require_robot(robot: Path, *others: Path) -> None:
    """Raise `InputError` where ROBOT is evidently something else, most likely because it was swapped with one of `others`."""
    if robot.suffix not in _NO_ROBOT and not robot.is_dir():
        return
    swapped = [path for path in others if path.suffix in (".yaml", ".yml")]
    if swapped:
        raise InputError(
            "E-CLI-005",
            f"{robot} stands where robot.yaml is expected; did you mean {swapped[0]} first, then {robot}?",
        )
    raise InputError(
        "E-CLI-006", f"{robot} is no robot.yaml; name the YAML file that describes the robot first."
    )


def require_robot_and_files(robot: Path, files: tuple[Path, ...], name: str) -> None:
    """Raise `InputError` where ROBOT is evidently something else, and where no file was given."""
    require_robot(robot, *files)
    if not files:
        raise InputError("E-CLI-007", f"no {name} given; name at least one file after robot.yaml.")
