"""Friction terms by cross-validation: the terms of the truth and no others, with errors as a solution row by row gives them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.friction import (
    Candidate,
    LoadCoulomb,
    SelectionStep,
    SublinearViscous,
    WarmUp,
    select_friction,
)
from flexcal.dynamics.friction.stepwise import FrictionChoice
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, DriveTerm, Observation
from flexcal.dynamics.regression import (
    ExperimentSystem,
    RegressionData,
    assemble_regression,
    experiment_system,
    folds,
    prediction_errors,
)
from flexcal.dynamics.regression import blocks as rows
from flexcal.dynamics.signals import Motion, Window
from flexcal.jobs.dynamics.remarks import dynamics_remarks
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_parameters

NOISE = np.array([0.6, 0.4, 0.2, 0.1, 0.1, 0.05])


def with_torques(
    model: RobotModel, terms: tuple[DriveTerm, ...], motion: Motion, size: float, seed: int
) -> Motion:
    """Torques of the CAD links, of drives with all classic parameters 2, and of further terms with parameters of that size."""
    rng = np.random.default_rng(seed)
    observation = Observation(model, (*CLASSIC, *terms))
    truth = observation.values()
    classic = len(Observation(model, CLASSIC).names)
    truth[60:classic], truth[classic:] = 2.0, size
    torques = [
        truth[m] @ c for m, c in zip(observation.column_indices, observation.columns(motion), strict=True)
    ]
    return replace(motion, torque=np.stack(torques, axis=1) + NOISE * rng.normal(size=(len(motion), model.n)))


def equations_of(motion: Motion, decimation: Decimation) -> Callable[[Observation], list[ExperimentSystem]]:
    return lambda observation: [
        experiment_system(observation, motion, decimation, Window(), mask_standstill=True)
    ]


@pytest.mark.parametrize("number", range(3))
def test_the_terms_of_the_truth_are_chosen(number: int, tx40: RobotModel, swing: Motion) -> None:
    inertials = inertial_parameters(tx40).ravel()
    terms, names = [
        ((), set()),
        ((SublinearViscous(),), {"sublinear_viscous"}),
        ((LoadCoulomb(inertials), WarmUp(4.0)), {"load_coulomb", "warm_up"}),
    ][number]
    motion = with_torques(tx40, terms, swing, 0.4 if number == 2 else 2.0, number)
    found = select_friction(tx40, "auto", equations_of(motion, Decimation(4)), Decimation(4))
    assert {candidate.name for candidate in found.chosen} == names
    assert found.names[:3] == ("viscous", "coulomb", "torque_offset")


def test_a_listed_term_stays_and_gets_its_best_shape(tx40: RobotModel, swing: Motion) -> None:
    """Also where cross-validation does not ask for it."""
    motion = with_torques(tx40, (), swing, 0.0, 9)
    listed = ("coulomb", "viscous", "stribeck", "presliding")
    found = select_friction(tx40, listed, equations_of(motion, Decimation(4)), Decimation(4))
    assert found.names == ("coulomb", "viscous", "stribeck", "presliding")
    for candidate in found.chosen:
        tried = [t for t in found.trials if t.terms[-1].startswith(candidate.name)]
        assert min(tried, key=lambda t: t.error).terms[-1] == candidate.label
    with refused("E-DYN-013", "sticky", "viscous, coulomb"):
        select_friction(tx40, ("sticky",), equations_of(motion, Decimation(4)), Decimation(4))


def test_the_error_is_that_of_predicting_each_block_from_rows_apart_from_it(
    tx40: RobotModel, swing: Motion
) -> None:
    """Dense weighted least squares on the rows outside each block and its surroundings, against the triangles."""
    observation = Observation(tx40, (*CLASSIC, SublinearViscous()))
    motion = with_torques(tx40, (SublinearViscous(),), swing, 0.5, 5)
    decimation, purge = Decimation(4), 24
    system = experiment_system(observation, motion, decimation, Window(), mask_standstill=True)
    width = len(observation.names)
    classic = BaseParameters.of(Observation(tx40, CLASSIC)).identifiability.kept
    fixed = [observation.names.index(Observation(tx40, CLASSIC).names[i]) for i in classic]
    group = list(range(width - 6, width))
    parts = [p.where(~p.still) for p in rows.regression_blocks(observation, motion, decimation, Window())]
    number = np.concatenate([p.number for p in parts]) // system.batch_rows
    matrices, torques = [], []
    for joint, members in enumerate(observation.column_indices):
        stack = np.hstack([np.vstack([p.columns[joint], p.torque[joint]]) for p in parts]).T
        wide = np.zeros((len(stack), width))
        wide[:, members] = stack[:, :-1]
        matrices.append(wide)
        torques.append(stack[:, -1])
    counts = {batch.number: batch.rows for batch in system.batches}
    middles = (
        np.cumsum(list(counts.values()))
        - np.array(list(counts.values()))
        + np.array(list(counts.values())) // 2
    )
    fold_of = {n: min(9, 10 * m // len(number)) for n, m in zip(counts, middles, strict=True)}
    fold = np.array([fold_of[n] for n in number])
    reach = -(-purge // system.batch_rows)
    missed, size = 0.0, 0.0
    for k in range(10):
        inside = fold == k
        low, high = number[inside].min() - reach, number[inside].max() + reach
        apart = (number < low) | (number > high)
        weighted, right = [], []
        for wide, torque in zip(matrices, torques, strict=True):
            own = wide[apart][:, fixed]
            residual = torque[apart] - own @ np.linalg.lstsq(own, torque[apart], rcond=1e-9)[0]
            sigma = np.linalg.norm(residual) / np.sqrt(apart.sum() - np.linalg.matrix_rank(own, rtol=1e-9))
            weighted.append(wide[apart] / sigma)
            right.append(torque[apart] / sigma)
        columns = fixed + group
        scale = np.linalg.norm(np.vstack(weighted)[:, columns], axis=0)
        x = (
            np.linalg.lstsq(np.vstack(weighted)[:, columns] / scale, np.concatenate(right), rcond=None)[0]
            / scale
        )
        for wide, torque in zip(matrices, torques, strict=True):
            missed += np.sum((torque[inside] - wide[inside][:, columns] @ x) ** 2)
            size += np.sum(torque[inside] ** 2)
    blocks = folds([system], observation.column_indices, width, fixed, purge)
    (found,) = prediction_errors(blocks, fixed, [group])
    assert found == pytest.approx(np.sqrt(missed / size), rel=1e-5)
    assert found < prediction_errors(blocks, fixed, [[]])[0]


def test_one_block_teaches_nothing_about_itself(tx40: RobotModel, swing: Motion) -> None:
    observation = Observation(tx40, CLASSIC)
    motion = with_torques(tx40, (), swing, 0.0, 6)
    system = experiment_system(observation, motion, Decimation(4), Window(), mask_standstill=True, batches=1)
    with refused("E-DYN-026"):
        folds([system], observation.column_indices, len(observation.names), [0], 10)


def test_a_column_that_the_data_leave_at_zero_is_named(tx40: RobotModel, swing: Motion) -> None:
    """A joint that never moves has no friction to show, whatever terms are declared."""
    still = np.array([1, 1, 0, 1, 1, 1])
    motion = with_torques(
        tx40, (), replace(swing, q=swing.q * still, dq=swing.dq * still, ddq=swing.ddq * still), 0.0, 3
    )
    observation = Observation(tx40, (*CLASSIC, SublinearViscous()))
    data: RegressionData = assemble_regression(
        observation, BaseParameters.of(observation), [motion], Decimation(4)
    )
    silent = {f"joint_3.{key}" for key in ("rotor_inertia", "viscous", "coulomb", "sublinear_viscous")}
    assert set(data.silent) == silent
    remarks = dynamics_remarks(data, weighted_least_squares(data))
    named = "rotor_inertia, viscous, coulomb, sublinear_viscous"
    assert f"joint_3: {named} keep their values: these recordings do not excite them" in remarks


def test_rivals_predict_as_well() -> None:
    """As many terms nearly so, or one more really so, whatever its significance; neither fewer nor two more."""
    chosen = Candidate("cable_stiffness", "", SublinearViscous())
    trials = (
        SelectionStep((), 0.2),
        SelectionStep(("cable_stiffness",), 0.100),
        SelectionStep(("warm_up",), 0.1009),
        SelectionStep(("stribeck",), 0.1011),
        SelectionStep(("cable_stiffness", "stribeck"), 0.0995),
        SelectionStep(("cable_stiffness", "warm_up"), 0.09, 0.2),
        SelectionStep(("cable_stiffness", "presliding"), 0.1001),
    )
    rivals = FrictionChoice((chosen,), trials).rivals
    assert rivals == (
        ("warm_up",),
        ("cable_stiffness", "stribeck"),
        ("cable_stiffness", "warm_up"),
    )
