"""Details of a measurement, for the sheets that a customer gets."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class MeasurementDetails:
    """Robot, instrument, operator and date of a measurement; an empty one leaves a line to fill in by hand."""

    robot_serial: str = ""
    instrument: str = ""
    instrument_serial: str = ""
    operator: str = ""
    date: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Label and text of each."""
        labels = {field.name: field.name.replace("_serial", ", serial number") for field in fields(self)}
        return [(label, getattr(self, name)) for name, label in labels.items()]


NOT_GIVEN = MeasurementDetails()
