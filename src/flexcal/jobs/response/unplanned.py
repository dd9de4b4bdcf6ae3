"""Frequency response, resonances and masses of an axis from records of any excitation, without a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
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
from flexcal.importing.columns import ResponseRecords, read_response_records
from flexcal.jobs.response.feedback import FeedbackCheck
from flexcal.jobs.response.spectra import measure_spectra
from flexcal.jobs.result_files import RunRecord, header, write_response_arrays, write_results
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


@dataclass(frozen=True, eq=False)
class IdentifiedExcitation:
    """Frequency response of the records `measured`, its modes, and the masses of the axis."""

    measured: ResponseRecords
    options: ExcitationOptions
    spectra: RecordSpectra
    identified: IdentifiedModes
    masses: AxisMasses
    halves: HalfDifference | None
    fed: FeedbackCheck
    period_s: float | None
    record: RunRecord
    files: tuple[Path, ...]

    @property
    def response(self) -> LocalResponse:
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
        fit, response = self.identified.fit, self.response
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
            "resonances": [_quantities(item) for item in resonances(fit)],
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


def identify_excitation(
    files: Sequence[Path],
    out: Path,
    options: ExcitationOptions,
    *,
    command: str = "",
    progress: Progress = silent,
) -> IdentifiedExcitation:
    """Measure the response, and write response.csv, response.npz, results.json and report.html to `out`.

    Raises `FlexcalError` where a file cannot be used, or the input excites no band.
    """
    progress("response", 0.0)
    measured = read_response_records(
        files,
        inputs=options.inputs,
        outputs=options.outputs,
        references=options.references,
        rate_hz=options.rate_hz,
    )
    try:
        result = _identified(measured, files, options, command, progress)
    except InputError:
        raise
    except FlexcalError as problem:
        raise InputError(problem.code, f"{files[0]}: {problem}") from problem
    _write(out, result)
    return result


def _identified(
    measured: ResponseRecords,
    files: Sequence[Path],
    options: ExcitationOptions,
    command: str,
    progress: Progress,
) -> IdentifiedExcitation:
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
    return IdentifiedExcitation(
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
        record=RunRecord(provenance(list(files), {"method": identified.response.method}), command),
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


def _write(out: Path, result: IdentifiedExcitation) -> None:
    from flexcal.jobs.pages import report_folder

    response, model = result.response, result.identified.fit.model
    chosen = result.masses.chosen
    masses = np.zeros(0) if chosen is None else chosen.chain.response(response.frequencies_hz)
    write_response_arrays(out, response, model.response(response.frequencies_hz), masses)
    write_text(out / RESPONSE_TABLE, _table(result))
    write_results(out, result.document())
    report_folder(out)


def _table(result: IdentifiedExcitation) -> str:
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
