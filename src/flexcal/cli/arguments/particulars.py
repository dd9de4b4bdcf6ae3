"""Options with the particulars of a measurement, of `flexcal report --customer` and `flexcal certificate`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

if TYPE_CHECKING:
    from flexcal.report.results import MeasurementDetails

_BLANK = arg(metavar="TEXT", help_behavior_hint="(default: a line to fill in)")


@dataclass(frozen=True, kw_only=True)
class ParticularsOptions:
    """What is printed of the measurement; a blank line to fill in by hand where it is not given."""

    instrument: Annotated[str, _BLANK] = ""
    """Instrument with which the points were measured."""
    instrument_serial: Annotated[str, _BLANK] = ""
    """Serial number of the instrument."""
    robot_serial: Annotated[str, _BLANK] = ""
    """Serial number of the robot."""
    operator: Annotated[str, _BLANK] = ""
    """Name of the person who measured."""
    date: Annotated[str, _BLANK] = ""
    """Date of the measurement."""

    @property
    def particulars(self) -> MeasurementDetails:
        """As the sheets take them."""
        from flexcal.report.results import MeasurementDetails

        return MeasurementDetails(
            robot_serial=self.robot_serial,
            instrument=self.instrument,
            instrument_serial=self.instrument_serial,
            operator=self.operator,
            date=self.date,
        )
