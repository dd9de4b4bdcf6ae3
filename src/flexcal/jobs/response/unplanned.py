"""Frequency response, resonances and masses of an axis from records of any excitation, without a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.elasticity.modal import (
    AxisMasses,
    IdentifiedModes,
    Peak,
    Resonance,
    antiresonances,
    identify_masses,
    identify_modes,
    misfit,
    peaks,
    refined_response,
    resonances,
)
from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import provenance
from flexcal.files.transaction import write_text
from flexcal.frequency.arbitrary import (
    Channel,
    HalfDifference,
    Hold,
    LocalResponse,
    RecordSpectra,
    Tones,
    detect_tones,
    excited_band,
    half_difference,
    local_response,
)
from flexcal.importing.columns import ResponseRecords, read_response_records, record_paths
from flexcal.jobs.pages import WrittenResult, summary_row
from flexcal.jobs.response.feedback import FeedbackCheck
from flexcal.jobs.response.spectra import measure_spectra
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header, write_response_arrays
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, excitation_checks

RESPONSE_TABLE = "response.csv"


@dataclass(frozen=True)
class ExcitationOptions:
    """Options: columns, sampling rate, band (Hz), kind of the input, numbers of modes and of masses (None: by evidence)."""

    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    references: tuple[str, ...] = ()
    rate_hz: float | None = None
    band: tuple[float, ...] = ()
    hold: Hold = "held"
    modes: int | None = None
    masses: int | None = None


@dataclass(frozen=True, eq=False, repr=False)
class AxisResponse(WrittenResult):
    """Result of `frequency_response`: response of an axis to any excitation, its modes, and its masses.

    Attributes
    ----------
    measured : ResponseRecords
        Records with their channels.
    options : ExcitationOptions
        What was asked for.
    spectra : RecordSpectra
        Spectra of the records in the band.
    identified : IdentifiedModes
        The fitted modes, and the measured response.
    masses : AxisMasses
        Fits of one to three masses, and the chosen one.
    halves : HalfDifference or None
        Difference of the first half of the records from the second; None where they are too few.
    fed : FeedbackCheck
        Effect of a controller on the output.
    period_s : float or None
        Period of the excitation, s; None where it has none.
    files : tuple of Path
        The files, or names of records in memory.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    measured: ResponseRecords
    options: ExcitationOptions
    spectra: RecordSpectra
    identified: IdentifiedModes
    masses: AxisMasses
    halves: HalfDifference | None
    fed: FeedbackCheck
    period_s: float | None
    files: tuple[Path, ...]
    record: RunRecord = NOT_RECORDED

    @property
    def subject(self) -> str:
        """Names of the records."""
        first, *others = (file.name for file in self.files)
        return first + (f" and {len(others)} more" if others else "")

    @property
    def headline(self) -> str:
        """Band, resonances and number of masses."""
        lines = self.response.frequencies_hz
        frequencies = ", ".join(f"{item.frequency_hz.estimate:.4g}" for item in self.resonances)
        return (
            f"{len(lines)} lines from {lines[0]:.3g} to {lines[-1]:.3g} Hz; "
            + (f"resonances at {frequencies} Hz" if frequencies else "no resonance")
            + (f"; {self.masses.count} masses" if self.masses.chosen is not None else "")
        )

    def summary(self) -> str:
        """Band and resonances, the masses with their standard deviations, remarks and verdict."""
        parameters = self._numbers["masses"]["parameters"]
        rows = [
            summary_row(name, one["estimate"], one["std"], one["unit"]) for name, one in parameters.items()
        ]
        return "\n".join([self.headline, *rows, *self._numbers["remarks"], self.trust.sentence])

    @property
    def resonances(self) -> tuple[Resonance, ...]:
        """Fitted resonances, each with `frequency_hz` and `damping`, with their standard deviations."""
        return resonances(self.identified.fit)

    def write_arrays(self, folder: Path) -> None:
        """Leave response.npz and response.csv in a folder."""
        lines, chosen = self.response.frequencies_hz, self.masses.chosen
        masses = np.zeros(0) if chosen is None else chosen.chain.response(lines)
        write_response_arrays(folder, self.response, self.identified.fit.model.response(lines), masses)
        write_text(folder / RESPONSE_TABLE, _table(self))

    @property
    def response(self) -> LocalResponse:
        """Measured response (L, n, m) at the lines of the band, with its standard deviations and coherence."""
        return self.identified.response

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(excitation_checks(self._numbers))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("excitation"), **self._numbers, "verdict": self.trust.document()}

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        response = self.response
        outputs, inputs = self.measured.outputs, self.measured.inputs
        return {
            "excitation": {
                "files": [file.name for file in self.files],
                "records": int(self.spectra.inputs.shape[0]),
                "seconds": float(sum(len(r) * r.time_step for r in self.measured.records)),
                "rate_hz": 1.0 / self.spectra.time_step,
                "period_s": self.period_s,
                "low_hz": float(response.frequencies_hz[0]),
                "high_hz": float(response.frequencies_hz[-1]),
                "lines": len(response.frequencies_hz),
                "correlated_hz": response.correlated_hz,
                "method": response.method,
                "hold": self.options.hold,
                "degrees_of_freedom": response.degrees_of_freedom,
                "inputs": [_channel(channel) for channel in inputs],
                "outputs": [_channel(channel) for channel in outputs],
                "references": [_channel(channel) for channel in self.measured.references],
            },
            "elements": [self._element(y, u) for y in range(len(outputs)) for u in range(len(inputs))],
            "feedback": self.fed.document(),
            "resonances": [_quantities(item) for item in self.resonances],
            "masses": self._masses(),
            "halves": None if self.halves is None else asdict(self.halves),
            "remarks": [*self.measured.remarks, *self._remarks()],
            **self.record.document(),
        }

    def _element(self, y: int, u: int) -> dict[str, Any]:
        response, coherence = self.response, self.response.coherence[:, y]
        level = np.abs(response.response[:, y, u])
        return {
            "output": self.measured.outputs[y].name,
            "input": self.measured.inputs[u].name,
            "unit": _unit(self.measured.outputs[y], self.measured.inputs[u]),
            "relative_std": float(np.median(response.std[:, y, u] / level)),
            "coherence": float(np.median(coherence)),
            "lowest_coherence": float(coherence.min()),
            "lowest_coherence_hz": float(response.frequencies_hz[int(coherence.argmin())]),
            "peaks": [_peak(item) for item in peaks(self.identified.fit, y, u)],
            "antiresonances": [_quantities(item) for item in antiresonances(self.identified.fit, y, u)],
        }

    def _masses(self) -> dict[str, Any]:
        masses = self.masses
        chosen = masses.chosen
        candidates = [
            {"masses": len(one.chain.inertias), "criterion": one.criterion, "mean_square": one.mean_square}
            for one in masses.candidates
        ]
        if chosen is None:
            return {
                "count": 0,
                "reason": masses.reason,
                "candidates": candidates,
                "parameters": {},
                "misfit": None,
            }
        units = _mass_units(self.measured.outputs[0], self.measured.inputs[0])
        return {
            "count": masses.count,
            "reason": "",
            "candidates": candidates,
            "parameters": {
                name: {**value.quantity(), "unit": units[name.partition("_")[0]]}
                for name, value in chosen.values().items()
            },
            "delay_s": chosen.chain.delay,
            "misfit": misfit(chosen, self.response),
        }

    def _remarks(self) -> list[str]:
        said = []
        if self.period_s is not None:
            said.append(
                f"the excitation repeats itself every {self.period_s:.6g} s; {self.spectra.periods} periods of each record are used, and "
                "their harmonics alone"
            )
        else:
            said.append(
                "the excitation is not periodic; the transients of every record are estimated with the response"
            )
        said.append(self.fed.remark)
        return said


def _channel(channel: Channel) -> dict[str, str]:
    return {
        "column": channel.name,
        "unit": channel.unit,
        "kind": ("position", "velocity", "acceleration")[channel.derivative],
    }


def _unit(output: Channel, input: Channel) -> str:
    return f"{output.unit or output.name}/s² per {input.unit or input.name}"


def _mass_units(output: Channel, input: Channel) -> dict[str, str]:
    force, way = input.unit or input.name, output.unit or output.name
    if (force, way) == ("N m", "rad"):
        return {"inertia": "kg m²", "stiffness": "N m/rad", "damping": "N m s/rad", "viscous": "N m s/rad"}
    if (force, way) == ("N", "m"):
        return {"inertia": "kg", "stiffness": "N/m", "damping": "N s/m", "viscous": "N s/m"}
    return {
        "inertia": f"{force} s²/{way}",
        "stiffness": f"{force}/{way}",
        "damping": f"{force} s/{way}",
        "viscous": f"{force} s/{way}",
    }


def _quantities(item: Resonance) -> dict[str, Any]:
    return {"frequency_hz": item.frequency_hz.quantity(), "damping": item.damping.quantity()}


def _peak(item: Peak) -> dict[str, Any]:
    return {"frequency_hz": item.frequency_hz.quantity(), "magnitude": item.magnitude}


def frequency_response(
    records: Sequence[str | Path | Mapping[str, np.ndarray]],
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    references: Sequence[str] = (),
    rate_hz: float | None = None,
    band: Sequence[float] = (),
    hold: Hold = "held",
    modes: int | None = None,
    masses: int | None = None,
    progress: Progress = silent,
) -> AxisResponse:
    """Frequency response, resonances and masses of an axis from records of any excitation, without a plan.

    Records of planned multisines are for `frequency_responses`.

    Parameters
    ----------
    records : sequence of path or mapping
        Records of one experiment, repetitions of each other, as files (CSV, text, Excel, MAT, Parquet, …) or in memory, columns (N,) by
        name: ``{"t": …, "torque[Nm]": …, "velocity[rad/s]": …}``.
    inputs, outputs, references : sequence of str
        Columns that drive the axis, that move, and that a controller was asked for, as COLUMN or COLUMN[unit]; recognised by default.
    rate_hz : float, optional
        Sampling rate where there is no column of time, Hz.
    band : sequence of float
        Lowest and highest frequency to use, Hz; by default where the input determines the response.
    hold : {"held", "instantaneous", "mean"}
        Whether a sample of the input is held until the next one, the value at the instant, or a mean over the step.
    modes, masses : int, optional
        Number of resonances, and of masses, 1 to 3; by default by evidence.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    AxisResponse
        Its `response`, `resonances`, `masses`, `summary()`, `report(path)` and `write(folder)`.

    Raises
    ------
    FlexcalError
        Where a record cannot be used, and where the input excites no band.

    Examples
    --------
    Two masses of 0.01 and 0.02 kg m² on a spring of 400 N m/rad resonate at 39 Hz:

    >>> import numpy as np
    >>> from scipy.signal import cont2discrete, dlsim
    >>> from flexcal import frequency_response
    >>> accelerations = [[-4e4, 4e4, -4.0, 4.0], [2e4, -2e4, 2.0, -2.0]]
    >>> A, B = np.array([[0, 0, 1, 0], [0, 0, 0, 1], *accelerations]), np.array([[0], [0], [100.0], [0]])
    >>> system = cont2discrete((A, B, np.array([[0, 0, 1, 0]]), np.zeros((1, 1))), 1e-3)
    >>> rng = np.random.default_rng(0)
    >>> torque = rng.standard_normal(8000)
    >>> velocity = dlsim(system, torque)[1][:, 0] + 0.01 * rng.standard_normal(8000)
    >>> record = {"t": 1e-3 * np.arange(8000), "torque[Nm]": torque, "velocity[rad/s]": velocity}
    >>> axis = frequency_response([record])
    >>> [round(item.frequency_hz.estimate) for item in axis.resonances]
    [39]
    """
    progress("response", 0.0)
    options = ExcitationOptions(
        tuple(inputs), tuple(outputs), tuple(references), rate_hz, tuple(band), hold, modes, masses
    )
    sources = [Path(one) if isinstance(one, str) else one for one in records]
    files = record_paths(sources)
    measured = read_response_records(
        sources,
        inputs=options.inputs,
        outputs=options.outputs,
        references=options.references,
        rate_hz=options.rate_hz,
    )
    try:
        return _identified(measured, files, options, progress)
    except InputError:
        raise
    except FlexcalError as problem:
        raise InputError(problem.code, f"{files[0]}: {problem}") from problem


def identify_excitation(
    files: Sequence[Path],
    out: Path,
    options: ExcitationOptions,
    *,
    command: str = "",
    progress: Progress = silent,
) -> AxisResponse:
    """`frequency_response` of files; response.csv, response.npz, results.json and report.html are written to `out`.

    Raises `FlexcalError` as `frequency_response` does; nothing is written then.
    """
    identified = frequency_response(files, **vars(options), progress=progress)
    origin = provenance(list(files), {"method": identified.response.method})
    result = replace(identified, record=RunRecord(origin, command))
    result.write(out)
    return result


def _identified(
    measured: ResponseRecords,
    files: Sequence[Path],
    options: ExcitationOptions,
    progress: Progress,
) -> AxisResponse:
    measured_spectra = measure_spectra(measured, options.hold)
    measured, period = measured_spectra.measured, measured_spectra.period
    spectra = _in_band(
        measured_spectra.whole,
        measured_spectra.usable,
        options.band,
        files,
        detect_tones(measured_spectra.pieces),
    )
    identified = identify_modes(spectra, local_response(spectra), modes=options.modes, progress=progress)
    masses = identify_masses(identified.fit, identified.response, options.masses)
    return AxisResponse(
        measured=measured,
        options=options,
        spectra=spectra,
        identified=identified,
        masses=masses,
        halves=_halves(spectra, identified),
        fed=FeedbackCheck.of(
            measured_spectra.loop,
            identified.response,
            spectra.periods,
            [channel.name for channel in measured.references],
            guessed=measured.guessed,
        ),
        period_s=None if period is None else period * spectra.time_step,
        files=tuple(files),
    )


def _in_band(
    whole: RecordSpectra,
    usable: np.ndarray | None,
    band: tuple[float, ...],
    files: Sequence[Path],
    few: Tones | None,
) -> RecordSpectra:
    if band:
        if len(band) != 2 or not 0 < band[0] < band[1]:
            raise InputError("E-RUN-074", "--band needs two frequencies in Hz, the lower one first.")
        kept = whole.between(band[0], band[1])
        if len(kept.frequencies_hz) < 2:
            raise InputError(
                "E-RUN-075",
                f"--band {band[0]:g} {band[1]:g}: the records reach from {whole.frequencies_hz[0]:.3g} to "
                f"{whole.frequencies_hz[-1]:.3g} Hz.",
            )
        return kept
    if few is not None and few.alone:
        raise InputError("E-RUN-076", f"{files[0]}: {few.sentence}")
    limits = excited_band(whole, local_response(whole), usable)
    if limits is None and few is not None:
        raise InputError("E-RUN-077", f"{files[0]}: {few.sentence}")
    if limits is None:
        raise InputError(
            "E-RUN-078",
            f"{files[0]}: at hardly any frequency does the output follow the input; check that the columns belong together (--input, "
            "--output), or excite more strongly.",
        )
    return whole.between(*limits)


def _halves(spectra: RecordSpectra, identified: IdentifiedModes) -> HalfDifference | None:
    """Comparison of the first half of the records with the second; None for one record, or too few."""
    records = spectra.inputs.shape[0]
    if records < 2:
        return None
    try:
        first, second = (
            refined_response(spectra.of_records(part), identified.fit.model, identified.response)
            for part in (slice(0, records // 2), slice(records // 2, None))
        )
    except FlexcalError:
        return None
    return half_difference(first, second) if len(first.frequencies_hz) == len(second.frequencies_hz) else None


def _table(result: AxisResponse) -> str:
    """Text of response.csv: one row per line and element."""
    rows = ["frequency_hz,output,input,real,imaginary,std,coherence"]
    response, std = result.response.response, result.response.std
    for y, output in enumerate(result.measured.outputs):
        for u, channel in enumerate(result.measured.inputs):
            names = ",".join('"' + name.replace('"', '""') + '"' for name in (output.name, channel.name))
            for k, frequency in enumerate(result.response.frequencies_hz):
                value = response[k, y, u]
                rows.append(
                    f"{frequency:.9g},{names},{value.real:.9g},{value.imag:.9g},{std[k, y, u]:.4g},{result.response.coherence[k, y]:.6g}"
                )
    return "\n".join(rows) + "\n"
