"""Selection of the number of masses of an axis by evidence."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from flexcal.elasticity.modal.chain_fit import ChainFit, fit_chain, pairs
from flexcal.elasticity.modal.fit import ModalFit
from flexcal.elasticity.modal.resonance_intervals import antiresonances, resonances
from flexcal.frequency.arbitrary import LocalResponse

MOST_MASSES = 3
_NOT_PASSIVE = 0.1
"""Share of lines with a phase impossible for a motor driven by its own torque, from which the response is not one."""
_PHASE = np.radians(15.0)
_WELL_KNOWN = 0.1
_FIRST = "give the motor's own position, velocity or acceleration as the first --output"
_MISSED = 0.3
"""Relative misfit from which the parameters of a chain are meaningless."""


@dataclass(frozen=True, eq=False)
class AxisMasses:
    """Candidates by number of masses, the `chosen` one, or the `reason` why there is none (a sentence's end)."""

    candidates: tuple[ChainFit, ...] = ()
    chosen: ChainFit | None = None
    reason: str = ""

    @property
    def count(self) -> int:
        return 0 if self.chosen is None else len(self.chosen.chain.inertias)


def identify_masses(fit: ModalFit, response: LocalResponse, masses: int | None = None) -> AxisMasses:
    """Fit chains of one mass up to the number that antiresonance-resonance pairs in the band allow, three at most, and choose by evidence.

    `masses` asks for a number. None is identified for several inputs, and for an output that is not where the input acts.
    """
    if response.response.shape[2] > 1:
        return AxisMasses(
            reason="several inputs act at once; record an axis with its own drive alone to fit masses to it"
        )
    alternating = pairs(fit)
    bare = _bare(fit)
    if bare is not None:
        return AxisMasses(
            reason=f"no antiresonance lies between the resonances at {bare[0]:.4g} and {bare[1]:.4g} Hz, as it does "
            f"where the input acts; {_FIRST}"
        )
    phase = _wrong_phase(response, fit)
    if _is_opposite(response):
        return AxisMasses(
            reason="the acceleration is opposite to the input: one of them counts the other way; change its sign"
        )
    if phase > _NOT_PASSIVE:
        return AxisMasses(
            reason=f"at {100 * phase:.0f} % of the lines the phase is not that of a motion where the input acts (acceleration 0 to "
            f"180° ahead of the force); {_FIRST}"
        )
    allowed = min(len(alternating) + 1, MOST_MASSES)
    if masses is not None and masses > allowed:
        low, high = fit.data.spectra.frequencies_hz[[0, -1]]
        return AxisMasses(
            reason=f"{masses} masses need {masses - 1} pairs of an antiresonance and the resonance above it, and the band from "
            f"{low:.3g} to {high:.3g} Hz shows {len(alternating)}; excite a wider band, or give --masses {allowed}"
        )
    strongest = sorted(alternating, key=lambda pair: pair[0] / pair[1])
    chain_sizes = range(1, allowed + 1) if masses is None else (masses,)
    fits = tuple(fit_chain(fit, count, sorted(strongest[: count - 1])) for count in chain_sizes)
    chosen = min(fits, key=lambda one: one.criterion)
    if masses is None and not alternating and _modes(fit):
        return AxisMasses(
            fits,
            reason="no antiresonance lies below a resonance in the band, as it does between two masses; excite lower frequencies",
        )
    missed = misfit(chosen, response)
    if not missed < _MISSED:
        return AxisMasses(
            fits,
            reason=f"the best chain, of {len(chosen.chain.inertias)}, misses the response by {100 * missed:.0f} % (rms)",
        )
    return AxisMasses(fits, chosen)


def misfit(chain: ChainFit, response: LocalResponse) -> float:
    """Root mean square relative difference of a chain and the measured response beyond noise, at well-determined lines."""
    measured, std = response.response[:, 0, 0], response.std[:, 0, 0]
    known = std < _WELL_KNOWN * np.abs(measured)
    if not known.any():
        return float("nan")
    predicted = chain.chain.response(response.frequencies_hz)
    difference = (
        np.abs(predicted[known] / measured[known] - 1.0) ** 2 - np.abs(std[known] / measured[known]) ** 2
    )
    return float(np.sqrt(max(np.mean(difference), 0.0)))


def _modes(fit: ModalFit) -> int:
    return len(resonances(fit))


def _bare(fit: ModalFit) -> tuple[float, float] | None:
    """Two neighbouring resonances (Hz) without an antiresonance between them; None where there are none."""
    poles = [item.frequency_hz.estimate for item in resonances(fit) if item.frequency_hz.known]
    zeros = [item.frequency_hz.estimate for item in antiresonances(fit, 0, 0)]
    return next(
        (pair for pair in pairwise(poles) if not any(pair[0] < zero < pair[1] for zero in zeros)), None
    )


def _is_opposite(response: LocalResponse) -> bool:
    """Whether the sign of the torque is reversed: the motion returns energy to the drive, and accelerates against it, at most lines."""
    measured, std = response.response[:, 0, 0], response.std[:, 0, 0]
    velocity = measured / (2j * np.pi * response.frequencies_hz)
    weight = np.abs(measured) / np.maximum(std, np.finfo(float).tiny)
    return bool((np.real(velocity) * np.minimum(weight, 10)).sum() < 0 and np.median(np.real(measured)) < 0)


def _wrong_phase(response: LocalResponse, fit: ModalFit) -> float:
    """Share of the lines, known to 30 %, with an acceleration not 0 to 180° ahead of the force, within 15° and a delay of a sample."""
    measured, std = response.response[:, 0, 0], response.std[:, 0, 0]
    known = std < 0.3 * np.abs(measured)
    if not known.any():
        return 0.0
    omega = 2 * np.pi * response.frequencies_hz[known]
    allowance = _PHASE + omega * fit.data.spectra.time_step
    phase = np.angle(
        measured[known] * np.exp(-1j * np.pi / 2)
    )  # about that of the velocity turned to 0 ± 90°
    return float(np.mean(np.abs(phase) > np.pi / 2 + allowance))
