"""Frequency response matrix of a robot in one pose, from motor torque to motor acceleration (eqs. (19)-(21))."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import ArrayForm, NpzFile, write_npz
from flexcal.files.transaction import current_path
from flexcal.frequency.periodic.averages import Average, average_response
from flexcal.frequency.periodic.covariance import input_gain, kronecker, output_noise, total_covariance, vec
from flexcal.frequency.periodic.pose_records import PoseRecords, by_pose
from flexcal.frequency.periodic.steady_state import experiment_spectra, keep_periods, odd_distortion

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
_SENSED = {
    "sensors": ArrayForm("text", ("sensors",)),
    "sensor_response": ArrayForm("complex", ("lines", "sensors", "axes")),
    "joint_covariance": ArrayForm("complex", ("lines", "all elements", "all elements")),
}


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Measured frequency response G from motor torques (N m) to motor accelerations (rad/s²) of the excited axes: L lines, n axes.

    Attributes
    ----------
    frequencies_hz : ndarray
        Frequencies (L,), Hz.
    response : ndarray
        G (L, n, n), complex; rows are accelerations; corrected for the hold.
    covariance : ndarray
        Covariance (L, n², n²), complex Hermitian, of vec (column-major) of `response`: noise and stochastic nonlinear distortion,
        the total of one realisation over R.
    noise_covariance : ndarray
        The same for the noise alone.
    degrees_of_freedom : float
        Degrees of freedom of `covariance`.
    realisations : ndarray
        Responses (R, L, n, n) of the realisations, those of eq. (20).
    joints : tuple of str
        Names of the axes.
    q_mean : ndarray
        Mean motor positions of all joints, rad, to linearise at.
    payload : float or None
        Mass, kg.
    pose : int
        Number of the pose in the plan.
    sample_time : float
        Sample time, s.
    average : str
        How the realisations were averaged.
    odd_distortion : ndarray or None
        Odd distortion (n,) of each axis, relative to its excited acceleration, where the plan left lines out to see it.
    sensors : tuple of str
        Names of the S sensors on the arm that recorded too.
    sensor_response : ndarray or None
        Response (L, S, n) from motor torques to their readings, m/s², m/s or m per N m; None without sensors.
    joint_covariance : ndarray or None
        Covariance (L, (n + S) n, (n + S) n) of vec of all rows, axes first; None without sensors.
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
    sensors: tuple[str, ...] = ()
    sensor_response: np.ndarray | None = None
    joint_covariance: np.ndarray | None = None

    @property
    def stacked(self) -> np.ndarray:
        """Response with the sensors' rows appended, (L, n + S, n)."""
        if self.sensor_response is None:
            return self.response
        return np.concatenate([self.response, self.sensor_response], axis=1)

    @property
    def stacked_covariance(self) -> np.ndarray:
        """Covariance (L, (n + S) n, (n + S) n) of vec(`stacked`)."""
        return self.covariance if self.joint_covariance is None else self.joint_covariance

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the rows of `stacked`: axes, then sensors."""
        return (*self.joints, *self.sensors)

    @property
    def stacked_std(self) -> np.ndarray:
        """Standard deviation (L, n + S, n) of every element of `stacked`."""
        return _elements(self.stacked_covariance, self.response.shape[-1])

    def at_lines(self, rows: slice) -> "FrequencyResponse":
        """Frequency response restricted to some lines.

        Parameters
        ----------
        rows : slice
            Indices of the lines.

        Returns
        -------
        FrequencyResponse
            The response at these lines.
        """
        own = (
            "frequencies_hz",
            "response",
            "covariance",
            "noise_covariance",
            *(("sensor_response", "joint_covariance") if self.sensors else ()),
        )
        kept = {name: getattr(self, name)[rows] for name in own}
        return replace(self, **kept, realisations=self.realisations[:, rows])

    @property
    def omega(self) -> np.ndarray:
        """Angular frequencies (L,) rad/s."""
        return 2.0 * np.pi * self.frequencies_hz

    @property
    def vec(self) -> np.ndarray:
        """Response (L, n²) vectorised column by column: the order of the covariances."""
        return vec(self.response)

    @property
    def std(self) -> np.ndarray:
        """Standard deviation (L, n, n) of every element, the root of E|δ|²."""
        return _elements(self.covariance, self.response.shape[-1])

    @property
    def noise_std(self) -> np.ndarray:
        """Noise part (L, n, n) of `std`."""
        return _elements(self.noise_covariance, self.response.shape[-1])

    @property
    def distortion_std(self) -> np.ndarray:
        """Remainder (L, n, n) of `std`: stochastic nonlinear distortion G_S of eq. (19); 0 where the noise explains it all."""
        return np.sqrt(np.maximum(self.std**2 - self.noise_std**2, 0.0))

    def log_covariance(self) -> np.ndarray:
        """Covariance (L, n², n²) of log vec G to first order, the weight of eqs. (26), (27); for std/|G| < 0.3."""
        vec = self.vec
        return self.covariance / (vec[:, :, None] * vec[:, None, :].conj())

    def save(self, path: str | Path) -> None:
        """Write the response to one .npz file, atomically.

        Parameters
        ----------
        path : str or Path
            File to write.
        """
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values["joints"] = np.array(self.joints)
        values["payload"] = np.nan if self.payload is None else self.payload
        values["odd_distortion"] = np.zeros(0) if self.odd_distortion is None else self.odd_distortion
        values["sensors"] = np.array(self.sensors, dtype=str)
        if not self.sensors:
            values = {name: value for name, value in values.items() if name not in _SENSED}
        write_npz(path, values)

    @classmethod
    def load(cls, path: str | Path) -> "FrequencyResponse":
        """Read a response written by `save`.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        FrequencyResponse
            The response.

        Raises
        ------
        InputError
            Where the file is missing or something else.
        """
        if not current_path(path).exists():
            raise InputError(
                "E-FRF-031", f"{path} does not exist; run 'flexcal identify response' to make it."
            )
        file = NpzFile(Path(path), "give what 'flexcal identify response' wrote")
        if "covariance" not in file:
            raise file.error("E-FRF-032", "is not a frequency response")
        values = file.read(_FORMS)
        lines, axes = values["response"].shape[:2]
        if axes == 0 or lines == 0 or values["frequencies_hz"].min() <= 0:
            raise file.error("E-FRF-033", "holds no response at positive frequencies")
        if values["covariance"].shape[1:] != (axes**2, axes**2):
            raise file.error(
                "E-FRF-034", f"holds a covariance of another size than the response's ({axes}, {axes})"
            )
        more: dict[str, Any] = {}
        if "sensors" in file:
            sensed = file.read(_SENSED)
            if sensed["joint_covariance"].shape[1:] != (axes * (axes + len(sensed["sensors"])),) * 2:
                raise file.error(
                    "E-FRF-035",
                    "holds a joint_covariance of another size than the responses of axes and sensors",
                )
            more = {**sensed, "sensors": tuple(sensed["sensors"].tolist())}
        payload = float(values["payload"])
        if np.isinf(payload):
            raise file.error("E-FRF-036", "holds an infinite payload")
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
            **more,
        )


def pose_response(
    plan: MultisinePlan,
    pose: int,
    recordings: Iterable[Recording],
    average: Average = "arithmetic",
    *,
    joint_names: Sequence[str] | None = None,
    pooled_lines: int = POOLED_LINES,
) -> FrequencyResponse:
    """Frequency response of one pose of a multisine experiment, from its recordings in any order.

    The recordings are streamed: of each only the spectra at the lines are kept. Settle periods are dropped, periods averaged, the
    two signs subtracted, (plus - minus)/2, and then Ĝ^[r] = (-ω² Q) Γ⁻¹ for each realisation (20), with the torque spectrum
    corrected for the hold.

    Parameters
    ----------
    plan : MultisinePlan
        Plan of the experiment.
    pose : int
        Index of the pose in the plan.
    recordings : iterable of Recording
        Labelled recordings; those of other poses are passed over.
    average : {"arithmetic", "logarithmic", "harmonic", "h1", "joint_input_output", "errors_in_variables"}
        How the realisations are averaged.
    joint_names : sequence of str, optional
        Names of the excited axes.
    pooled_lines : int
        Number of neighbouring lines that share one covariance; more in the proportion of outputs to axes where sensors on the arm
        recorded too.

    Returns
    -------
    FrequencyResponse
        From motor torques to motor accelerations, `response` (L, n, n) with its `covariance`.

    Raises
    ------
    FlexcalError
        Where a recording is missing, double, too short or does not fit the plan, where there are fewer than two realisations (then
        see `local_polynomial_responses`), or the excitation does not reach every axis.
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
    """Frequency response of every pose of a multisine experiment, in one pass over its recordings.

    Parameters
    ----------
    plan : MultisinePlan
        Plan of the experiment.
    recordings : iterable of Recording
        Labelled recordings, in any order.
    average : {"arithmetic", "logarithmic", "harmonic", "h1", "joint_input_output", "errors_in_variables"}
        How the realisations are averaged.
    joint_names : sequence of str, optional
        Names of the excited axes.
    pooled_lines : int
        Number of neighbouring lines that share one covariance; more in the proportion of outputs to axes where sensors on the arm
        recorded too.

    Returns
    -------
    iterator of FrequencyResponse
        Each is yielded when the recordings of its pose are complete.

    Raises
    ------
    FlexcalError
        Where a recording is missing, double, too short or does not fit the plan, where there are fewer than two realisations, or the
        excitation does not reach every axis.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from flexcal import RobotModel, VirtualCell, frequency_plan, frequency_responses
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> plan = frequency_plan(model, "examples/tx90l/frequency_poses.csv", "default", seed=0)
    >>> plan = replace(plan, joints=(1,), amplitude=plan.amplitude[1:2], poses=plan.poses[:2])
    >>> plan = replace(plan, realisations=3, signs=False, periods=2, settle_periods=1)
    >>> [measured.pose for measured in frequency_responses(plan, VirtualCell(model).record(plan))]
    [0, 1]
    """
    for records in by_pose(plan, recordings, keep_periods):
        yield response_of(records, average, joint_names=joint_names, pooled_lines=pooled_lines)


def response_of(
    records: PoseRecords,
    average: Average = "arithmetic",
    *,
    joint_names: Sequence[str] | None = None,
    pooled_lines: int = POOLED_LINES,
) -> FrequencyResponse:
    """Frequency response from collected spectra; see `pose_response`."""
    plan = records.plan
    joints = axis_names(plan, joint_names)
    members = plan.realisations
    lines = np.asarray(plan.lines)
    if members < 2 or (members - 1) * min(pooled_lines, lines.size) < SMALLEST_FREEDOM:
        raise FlexcalError(
            "E-FRF-037",
            f"{members} realisations of {lines.size} lines leave too little scatter for a covariance with "
            f"{SMALLEST_FREEDOM} degrees of freedom; measure more realisations, pool more lines, or use "
            "the local polynomial method (--method local-polynomial).",
        )
    # sensors add elements to the covariance: as many degrees of freedom for each as without
    pooled_lines = -(-pooled_lines * (len(joints) + len(records.sensors)) // len(joints))
    spectra = experiment_spectra(records, pooled_lines)
    if records.sensors and average not in ("arithmetic", "h1", "joint_input_output"):
        raise FlexcalError(
            "E-FRF-038",
            f"the average '{average}' is of square matrices, but the sensors {', '.join(records.sensors)} recorded too; use "
            "arithmetic, h1 or joint_input_output.",
        )
    try:
        inverse = np.linalg.inv(spectra.torque)
    except np.linalg.LinAlgError as problem:
        raise FlexcalError(
            "E-FRF-039",
            "the torque of the experiments leaves an axis unexcited at some line (Γ is singular).",
        ) from (problem)
    realisations, gain = spectra.outputs @ inverse, input_gain(inverse)
    mean = realisations.mean(0)
    noise = output_noise(mean, spectra.noise)
    total, freedom = total_covariance(realisations, mean, noise, gain, pooled_lines)
    n = len(joints)
    return FrequencyResponse(
        frequencies_hz=lines * plan.base_frequency_hz,
        **sensed(records.sensors, n, average_response(spectra, realisations, average), total),
        noise_covariance=kronecker(gain / members, noise[:, :n, :n]),
        degrees_of_freedom=freedom,
        realisations=realisations[:, :, :n],
        joints=joints,
        q_mean=records.q_mean,
        payload=plan.payload,
        pose=records.pose,
        sample_time=records.time_step,
        average=average,
        odd_distortion=odd_distortion(records, mean[:, :n], noise[:, :n, :n]),
    )


def sensed(
    sensors: tuple[str, ...], axes: int, stacked: np.ndarray, covariance: np.ndarray
) -> dict[str, Any]:
    """Response fields split from `stacked` rows (L, n + S, n), axes then sensors, and the `covariance` of their vec."""
    if not sensors:
        return {"response": stacked, "covariance": covariance}
    own = (
        np.arange(axes)[:, None] * stacked.shape[1] + np.arange(axes)
    ).ravel()  # columns, of each the axes' rows
    return {
        "response": stacked[:, :axes],
        "covariance": covariance[:, own[:, None], own],
        "sensors": sensors,
        "sensor_response": stacked[:, axes:],
        "joint_covariance": covariance,
    }


def _elements(covariance: np.ndarray, axes: int) -> np.ndarray:
    """Standard deviations (L, m, n) from a covariance (L, m n, m n) of vec, for `axes` columns."""
    variance = np.real(np.diagonal(covariance, axis1=-2, axis2=-1))
    return np.sqrt(np.swapaxes(variance.reshape(len(variance), axes, -1), -1, -2))


def axis_names(plan: MultisinePlan, given: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the excited axes; raises `FlexcalError` for a wrong number of them."""
    names = tuple(given) if given is not None else tuple(f"joint_{j + 1}" for j in plan.joints)
    if len(names) != len(plan.joints):
        raise FlexcalError(
            "E-FRF-040", f"{len(names)} joint names were given for {len(plan.joints)} excited axes."
        )
    return names
