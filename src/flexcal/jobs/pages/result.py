"""Base classes of the results of all verbs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from flexcal.estimation import Estimate
from flexcal.files.formats import Block, write_estimates
from flexcal.files.transaction import read_text, write_text
from flexcal.jobs.result_files import ESTIMATES, write_results
from flexcal.model.robot import RobotModel
from flexcal.report.layout import Page, write_page

if TYPE_CHECKING:
    from flexcal.dynamics.diagnostics import TorquePrediction


class SummarisedResult(ABC):
    """Result of a verb: a short `repr`, a summary in text, and all numbers as a document."""

    @property
    @abstractmethod
    def subject(self) -> str:
        """Name of the robot or of the measurement that the result is about."""

    @property
    @abstractmethod
    def headline(self) -> str:
        """The result in one line, without the subject."""

    @abstractmethod
    def summary(self) -> str:
        """The result in a few lines of text, for people."""

    @abstractmethod
    def document(self) -> dict[str, Any]:
        """All numbers, as results.json or --json has them."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.subject}: {self.headline}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>"


@dataclass(frozen=True, eq=False, repr=False)
class Result(SummarisedResult):
    """Result of a verb about the robot `model`."""

    model: RobotModel

    @property
    def subject(self) -> str:
        """Name of the robot."""
        return self.model.name


@dataclass(frozen=True, eq=False, repr=False)
class PlottedResult(Result):
    """Result whose report needs no further files."""

    @abstractmethod
    def _page(self) -> Page:
        """The report."""

    def report(self, path: str | Path) -> Path:
        """Write the result as one HTML page.

        Parameters
        ----------
        path : str or Path
            File to write.

        Returns
        -------
        Path
            The file.
        """
        path = Path(path)
        write_page(path, self._page())
        return path


@dataclass(frozen=True, eq=False, repr=False)
class PlottedFolder(PlottedResult):
    """Plotted result with a folder of results.json and report.html."""

    def write(self, folder: str | Path) -> None:
        """Write results.json and report.html to a folder.

        Parameters
        ----------
        folder : str or Path
            The folder, which is created where it is missing.
        """
        from flexcal.jobs.pages.report import REPORT

        write_results(Path(folder), self.document())
        self.report(Path(folder) / REPORT)


class WrittenResult(SummarisedResult):
    """Result with a folder of files, and a report that is made from them."""

    @abstractmethod
    def write_arrays(self, folder: Path) -> None:
        """Leave the arrays of the result in a folder, beside results.json."""

    def write(self, folder: str | Path) -> None:
        """Write results.json, report.html and the arrays that it shows to a folder.

        Parameters
        ----------
        folder : str or Path
            The folder, which is created where it is missing.
        """
        from flexcal.jobs.pages.report import report_folder

        folder = Path(folder)
        write_results(folder, self.document())
        self.write_arrays(folder)
        report_folder(folder)

    def report(self, path: str | Path) -> Path:
        """Write the result as one HTML page.

        Parameters
        ----------
        path : str or Path
            File to write.

        Returns
        -------
        Path
            The file.
        """
        from flexcal.jobs.pages.report import REPORT

        path = Path(path)
        with TemporaryDirectory() as folder:
            self.write(folder)
            write_text(path, read_text(Path(folder) / REPORT))
        return path


@dataclass(frozen=True, eq=False, repr=False)
class ReportedResult(Result, WrittenResult):
    """Result about a robot, with a folder of files and a report that is made from them."""


@dataclass(frozen=True, eq=False, repr=False)
class Identification(ReportedResult):
    """Result of a verb that estimates parameters: `estimate`, already applied to `model`, is the block `block` of estimates.yaml."""

    block: ClassVar[Block]
    estimate: Estimate

    def write(self, folder: str | Path) -> None:
        """As `ReportedResult.write`, with estimates.yaml, whose other blocks are kept."""
        write_estimates(Path(folder) / ESTIMATES, self.block, self.estimate)
        super().write(folder)

    def store(self, source: Path, out: Path | None, others: Mapping[Block, Estimate]) -> None:
        """Store the estimate in the robot's own estimates.yaml `source`, or with the `others` it started from in the folder `out`."""
        if out is None:
            write_estimates(source, self.block, self.estimate)
            return
        if out / ESTIMATES != source:
            for name, other in others.items():
                write_estimates(out / ESTIMATES, name, other)
        self.write(out)


@dataclass(frozen=True, eq=False, repr=False)
class TorqueIdentification(Identification):
    """Result of a verb that estimates parameters from torques: `predictions` has measured and predicted torques of every log."""

    predictions: tuple[TorquePrediction, ...]

    @property
    def residuals(self) -> tuple[np.ndarray, ...]:
        """Measured minus predicted torques (M, n), N m, of every log, at the times of its prediction."""
        return tuple(prediction.measured - prediction.predicted for prediction in self.predictions)

    def write_arrays(self, folder: Path) -> None:
        """Leave predictions.npz in a folder."""
        from flexcal.jobs.result_files import write_predictions

        write_predictions(folder, self.predictions)


def estimate_row(estimate: Estimate, name: str) -> str:
    """Summary line of a parameter of an estimate."""
    return _row(name, estimate.values[name], estimate.spread(name), estimate.parameters[name].unit)


def summary_row(name: str, value: float, std: float | None, unit: str) -> str:
    """Summary line of a parameter; without a standard deviation if it is not identifiable."""
    return _row(name, value, "" if std is None else f"± {std:.2g}", unit)


def _row(name: str, value: float, spread: str, unit: str) -> str:
    return f"{name:<60.60} {value:>12.5g} {spread:<12} {unit}"
