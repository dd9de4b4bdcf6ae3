"""Estimators of dynamic parameters as objects with one signature.

Each imports what it computes with when it fits: the command line reads their names and summaries at every start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol

if TYPE_CHECKING:
    from flexcal.dynamics.estimators.recorded_rows import RecordedRows
    from flexcal.dynamics.regression import RegressionData
    from flexcal.estimation import Estimate


class Estimator(Protocol):
    """Interface of the estimators that `identify_dynamics` takes.

    Attributes
    ----------
    name : str
        Name in files, messages and on the command line.
    summary : str
        One line for the help page.
    """

    name: ClassVar[EstimatorName]
    summary: ClassVar[str]

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """The base parameters, with the covariance that the estimator claims.

        Parameters
        ----------
        equations : RegressionData
            Triangular factors of the regression: enough for estimators that are linear in the torques.
        rows : RecordedRows
            The rows that they were made of, log after log, for estimators that need to see them again.

        Returns
        -------
        Estimate
            Values in SI units with their joint covariance.

        Raises
        ------
        FlexcalError
            Where the logs do not determine what the estimator needs.
        """
        ...


@dataclass(frozen=True)
class OLS:
    """Ordinary least squares: all equations weigh the same.

    Examples
    --------
    >>> from flexcal import OLS, RobotModel, identify_dynamics
    >>> model = RobotModel.from_yaml("examples/tx40/robot.yaml")
    >>> identify_dynamics(model, ["examples/tx40/exciting.parquet"], estimator=OLS(), friction="classic")
    <DynamicsIdentification of staubli_tx40: 61 of 61 base parameters by ols, relative torque error ... % in the fit>
    """

    name: ClassVar[EstimatorName] = "ols"
    summary: ClassVar[str] = "ordinary least squares"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.ols import ordinary_least_squares

        return ordinary_least_squares(equations)


@dataclass(frozen=True)
class WLS:
    """Weighted least squares: each joint and log is weighted by the variance of its residuals, which may be correlated in time.

    The default of `identify_dynamics`.
    """

    name: ClassVar[EstimatorName] = "wls"
    summary: ClassVar[str] = "weighted least squares, every joint and log by its own noise"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.wls import weighted_least_squares

        return weighted_least_squares(equations)


@dataclass(frozen=True)
class SDP:
    """Weighted least squares with physically consistent links, by semidefinite programming (Sousa and Cortesão 2014).

    The inertials can be used in a simulation and in a URDF.
    """

    name: ClassVar[EstimatorName] = "sdp"
    summary: ClassVar[str] = "as wls, with physically consistent inertials"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.feasible import feasible_least_squares

        return feasible_least_squares(equations)


@dataclass(frozen=True)
class IRLS:
    """Iteratively reweighted least squares with the Huber loss, for logs with outliers."""

    name: ClassVar[EstimatorName] = "irls"
    summary: ClassVar[str] = "as wls, robust to outliers in single rows (Huber)"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.irls import huber_least_squares

        return huber_least_squares(equations, rows)


@dataclass(frozen=True)
class TLS:
    """Total least squares: takes account of the noise of positions in the regressor (Van Huffel and Vandewalle 1991)."""

    name: ClassVar[EstimatorName] = "tls"
    summary: ClassVar[str] = "total least squares, with the noise of the positions"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.column_noise import perturbed_logs, regressor_errors
        from flexcal.dynamics.estimators.tls import total_least_squares

        return total_least_squares(equations, regressor_errors(rows, perturbed_logs(rows)))


@dataclass(frozen=True)
class IV:
    """Instrumental variables from the simulated closed loop (Janot, Vandanjon and Gautier 2014).

    Without the bias of noisy velocities; needs `controller:` in robot.yaml.
    """

    name: ClassVar[EstimatorName] = "iv"
    summary: ClassVar[str] = (
        "instrumental variables, without the bias of noisy velocities (simulates the robot under the `controller:` of robot.yaml)"
    )

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.idim_iv import instrumental_variables

        return instrumental_variables(equations, rows)


@dataclass(frozen=True)
class DIDIM:
    """Direct and inverse dynamic identification model: from torques alone, by simulation (Gautier, Janot and Vandanjon 2013).

    Needs `controller:` in robot.yaml.
    """

    name: ClassVar[EstimatorName] = "didim"
    summary: ClassVar[str] = (
        "direct and inverse dynamic identification models, from torques alone (simulates it too)"
    )

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.didim import direct_and_inverse

        return direct_and_inverse(equations, rows)


@dataclass(frozen=True)
class EnergyModel:
    """Least squares of the energy balance of the whole robot; needs no accelerations (Gautier and Khalil 1988)."""

    name: ClassVar[EstimatorName] = "energy"
    summary: ClassVar[str] = "energy of all joints, one equation per row"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.energy_model import energy_least_squares

        return energy_least_squares(rows)


@dataclass(frozen=True)
class PowerModel:
    """Least squares of the power balance of the whole robot, one equation per sample (Gautier 1997)."""

    name: ClassVar[EstimatorName] = "power"
    summary: ClassVar[str] = "power of all joints, one equation per row"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.power_model import power_least_squares

        return power_least_squares(rows)


@dataclass(frozen=True)
class ML:
    """Maximum likelihood in the frequency domain for periodic excitation.

    The noise comes from four or more periods of one motion (Swevers, Ganseman, Tükel, De Schutter and Van Brussel 1997).
    """

    name: ClassVar[EstimatorName] = "ml"
    summary: ClassVar[str] = "maximum likelihood, with noise from four or more periods of one motion"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.periodic_likelihood import maximum_likelihood

        return maximum_likelihood(equations, rows)


@dataclass(frozen=True)
class EKF:
    """Extended Kalman filter and smoother that estimates states and parameters together (Gautier and Poignet 2001)."""

    name: ClassVar[EstimatorName] = "ekf"
    summary: ClassVar[str] = "extended Kalman filter"

    def fit(self, equations: RegressionData, rows: RecordedRows) -> Estimate:
        """As `Estimator.fit`."""
        from flexcal.dynamics.estimators.ekf import kalman_filter

        return kalman_filter(equations, rows)


EstimatorName = Literal["wls", "ols", "sdp", "irls", "iv", "didim", "energy", "power", "tls", "ml", "ekf"]

ESTIMATORS: dict[EstimatorName, Estimator] = {
    "wls": WLS(),
    "ols": OLS(),
    "sdp": SDP(),
    "irls": IRLS(),
    "iv": IV(),
    "didim": DIDIM(),
    "energy": EnergyModel(),
    "power": PowerModel(),
    "tls": TLS(),
    "ml": ML(),
    "ekf": EKF(),
}
"""The estimators by name."""
