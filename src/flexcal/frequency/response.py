"""The frequency response matrix of a robot in one pose, from motor torque to motor acceleration (eqs. (19)-(21))."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from flexcal.atomic import atomic_path
from flexcal.data import MultisinePlan, Recording
from flexcal.errors import FlexcalError, InputError
from flexcal.frequency import covariance as cov
from flexcal.frequency.averages import Average, average_response, right_divide
from flexcal.frequency.periods import experiment_spectra, keep_periods, odd_distortion
from flexcal.frequency.records import PoseRecords, by_pose
from flexcal.npz_reader import ArrayForm, NpzFile
from flexcal.publication import current

POOLED_LINES = 15  # neighbouring lines that share one covariance: 45 degrees of freedom with 4 realisations
SMALLEST_FREEDOM = 20

_MATRICES = ArrayForm("complex", ("lines", "axes", "axes"))
_COVARIANCES = ArrayForm("complex", ("lines", "elements", "elements"))
_FORMS = {
    "frequencies_hz": ArrayForm("real", ("lines",)),
    "response": _MATRICES,
    "covariance": _COVARIANCES,
    "noise_covariance": _COVARIANCES,
    "degrees_of_freedom": ArrayForm("real"),
    "realisations": ArrayForm("complex", ("realisations", "lines", "axes", "axes")),
    "joints": ArrayForm("text", ("axes",)),
    "q_mean": ArrayForm("real", ("all joints",)),
    "payload": ArrayForm("real", finite=False),
    "pose": ArrayForm("whole"),
    "sample_time": ArrayForm("real"),
    "average": ArrayForm("text"),
    "odd_distortion": ArrayForm("real", ("axes or none",)),
}


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Measured G from motor torque (N m) to motor acceleration (rad/s²) of the excited axes: L lines, n axes.

    frequencies_hz (L,); response (L, n, n) complex, rows are accelerations, hold corrected;
    covariance (L, n², n²) complex Hermitian, of vec (column-major) of `response`: noise and stochastic nonlinear
    distortion, the total of one realisation over R; noise_covariance the same for the noise alone;
    degrees_of_freedom behind `covariance`; realisations (R, L, n, n), those of eq. (20); joints: names of the axes;
    q_mean (all joints,) rad, the mean motor position to linearise at; payload kg or None; pose: its number in the
    plan; sample_time s; average: how the realisations were averaged; odd_distortion (n,) of each axis, relative to its
    excited acceleration, where the plan left lines out to see it.
    """

    frequencies_hz: np.ndarray
    response: np.ndarray
    covariance: np.ndarray
    noise_covariance: np.ndarray
    degrees_of_freedom: float
    realisations: np.ndarray
    joints: tuple[str, ...]
    q_mean: np.ndarray
    payload: float | None
    pose: int
    sample_time: float
    average: str = "arithmetic"
    odd_distortion: np.ndarray | None = None

    @property
    def omega(self) -> np.ndarray:
        """Angular frequencies (L,) rad/s."""
        return 2.0 * np.pi * self.frequencies_hz

    @property
    def vec(self) -> np.ndarray:
        """`response` stacked by columns, (L, n²): the order of the covariances."""
        return np.swapaxes(self.response, -1, -2).reshape(self.response.shape[0], -1)

    @property
    def std(self) -> np.ndarray:
        """Standard deviation (L, n, n) of every element, the root of E|δ|²."""
        return self._elements(self.covariance)

    @property
    def noise_std(self) -> np.ndarray:
        """The part of `std` that the noise alone explains, (L, n, n)."""
        return self._elements(self.noise_covariance)

    @property
    def distortion_std(self) -> np.ndarray:
        """The rest, (L, n, n): stochastic nonlinear distortion G_S of eq. (19); 0 where the noise explains it all."""
        return np.sqrt(np.maximum(self.std**2 - self.noise_std**2, 0.0))

    def log_covariance(self) -> np.ndarray:
        """Covariance (L, n², n²) of log vec G to first order, the weight of eqs. (26), (27); for std/|G| < 0.3."""
        vec = self.vec
        return self.covariance / (vec[:, :, None] * vec[:, None, :].conj())

    def save(self, path: str | Path) -> None:
        """Write everything into one .npz file, atomically."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values["joints"] = np.array(self.joints)
        values["payload"] = np.nan if self.payload is None else self.payload
        values["odd_distortion"] = np.zeros(0) if self.odd_distortion is None else self.odd_distortion
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, **values)

    @classmethod
    def load(cls, path: str | Path) -> "FrequencyResponse":
        """Read what `save` wrote; `InputError` where the file is missing or something else."""
        if not current(path).exists():
            raise InputError(f"{path} does not exist; run 'flexcal identify response' to make it.")
        file = NpzFile(Path(path), "give what 'flexcal identify response' wrote")
        if "covariance" not in file:
            raise file.error("is not a frequency response")
        values = file.read(_FORMS)
        lines, axes = values["response"].shape[:2]
        if axes == 0 or lines == 0 or values["frequencies_hz"].min() <= 0:
            raise file.error("holds no response at positive frequencies")
        if values["covariance"].shape[1:] != (axes**2, axes**2):
            raise file.error(f"holds a covariance of another size than the response's ({axes}, {axes})")
        payload = float(values["payload"])
        return cls(
            frequencies_hz=values["frequencies_hz"],
            response=values["response"],
            covariance=values["covariance"],
            noise_covariance=values["noise_covariance"],
            degrees_of_freedom=float(values["degrees_of_freedom"]),
            realisations=values["realisations"],
            joints=tuple(values["joints"].tolist()),
            q_mean=values["q_mean"],
            payload=None if np.isnan(payload) else payload,
            pose=int(values["pose"]),
            sample_time=float(values["sample_time"]),
            average=str(values["average"]),
            odd_distortion=values["odd_distortion"] if values["odd_distortion"].size else None,
        )

    def _elements(self, covariance: np.ndarray) -> np.ndarray:
        n = self.response.shape[-1]
        variance = np.real(np.diagonal(covariance, axis1=-2, axis2=-1)).reshape(-1, n, n)
        return np.sqrt(np.swapaxes(variance, -1, -2))


def frequency_response(
    plan: MultisinePlan,
    pose: int,
    recordings: Iterable[Recording],
    average: Average = "arithmetic",
    *,
    joint_names: Sequence[str] | None = None,
    pooled_lines: int = POOLED_LINES,
) -> FrequencyResponse:
    """The frequency response of one pose of a multisine experiment, from its recordings in any order.

    The recordings are streamed, those of other poses passed over: of each only the spectra at the lines are kept. Settle
    periods are dropped, periods averaged, the two signs subtracted, (plus - minus)/2, and then
    Ĝ^[r] = (-ω² Q) Γ⁻¹ for each realisation (20), with the torque spectrum corrected for the hold.
    `pooled_lines` neighbouring lines share one covariance. `joint_names`: of the excited axes.
    Raises `FlexcalError` where a recording is missing, double, too short or does not fit the plan, where there are
    fewer than two realisations (then see `local_polynomial_responses`), or the excitation does not reach every axis.
    """
    (records,) = by_pose(plan, recordings, keep_periods, [pose])
    return response_of(records, average, joint_names=joint_names, pooled_lines=pooled_lines)


def frequency_responses(
    plan: MultisinePlan,
    recordings: Iterable[Recording],
    average: Average = "arithmetic",
    *,
    joint_names: Sequence[str] | None = None,
    pooled_lines: int = POOLED_LINES,
) -> Iterator[FrequencyResponse]:
    """`frequency_response` for every pose of the plan in one pass over its recordings; each is yielded when complete."""
    for records in by_pose(plan, recordings, keep_periods):
        yield response_of(records, average, joint_names=joint_names, pooled_lines=pooled_lines)


def response_of(
    records: PoseRecords,
    average: Average = "arithmetic",
    *,
    joint_names: Sequence[str] | None = None,
    pooled_lines: int = POOLED_LINES,
) -> FrequencyResponse:
    """The frequency response from collected spectra; see `frequency_response`."""
    plan = records.plan
    joints = axis_names(plan, joint_names)
    members = plan.realisations
    lines = np.asarray(plan.lines)
    if members < 2 or (members - 1) * min(pooled_lines, lines.size) < SMALLEST_FREEDOM:
        raise FlexcalError(
            f"{members} realisations of {lines.size} lines leave too little scatter for a covariance with "
            f"{SMALLEST_FREEDOM} degrees of freedom; measure more realisations, pool more lines, or use "
            "the local polynomial method (--method local-polynomial)."
        )
    spectra = experiment_spectra(records, pooled_lines)
    try:
        realisations = right_divide(spectra.acceleration, spectra.torque)
        gain = cov.input_gain(spectra.torque)
    except np.linalg.LinAlgError as problem:
        raise FlexcalError(
            "the torque of the experiments leaves an axis unexcited at some line (Γ is singular)."
        ) from (problem)
    mean = realisations.mean(0)
    noise = cov.output_noise(mean, spectra.noise)
    total, freedom = cov.total_covariance(realisations, mean, noise, gain, pooled_lines)
    return FrequencyResponse(
        frequencies_hz=lines * plan.base_frequency_hz,
        response=average_response(spectra, realisations, average),
        covariance=total / members,
        noise_covariance=cov.kronecker(gain, noise) / members,
        degrees_of_freedom=freedom,
        realisations=realisations,
        joints=joints,
        q_mean=records.q_mean,
        payload=plan.payload,
        pose=records.pose,
        sample_time=records.time_step,
        average=average,
        odd_distortion=odd_distortion(records, mean, noise),
    )


def axis_names(plan: MultisinePlan, given: Sequence[str] | None) -> tuple[str, ...]:
    """The names of the excited axes; raises `FlexcalError` where another number of them is given."""
    names = tuple(given) if given is not None else tuple(f"joint_{j + 1}" for j in plan.joints)
    if len(names) != len(plan.joints):
        raise FlexcalError(f"{len(names)} joint names were given for {len(plan.joints)} excited axes.")
    return names
