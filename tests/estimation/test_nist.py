"""NIST Statistical Reference Datasets for nonlinear regression: certified values, scored in matching digits.

Data and certified values: NIST/ITL StRD, https://www.itl.nist.gov/div898/strd (public domain).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from flexcal.estimation import Parameter, Parameters, Problem, solve


@dataclass(frozen=True)
class Certified:
    model: Callable[[np.ndarray, np.ndarray], np.ndarray]
    starts: tuple[tuple[float, ...], ...]
    values: tuple[float, ...]
    stds: tuple[float, ...]
    sum_of_squares: float
    y: tuple[float, ...]
    x: tuple[float, ...]


def exponential_rise(b, x):
    return b[0] * (1 - np.exp(-b[1] * x))


def cubic_over_cubic(b, x):
    return (b[0] + x * (b[1] + x * (b[2] + x * b[3]))) / (1 + x * (b[4] + x * (b[5] + x * b[6])))


def richards(b, x):
    return b[0] * (1 + np.exp(b[1] - b[2] * x)) ** (-1 / b[3])


def kowalik_osborne(b, x):
    return b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3])


def peak(b, x):
    return b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2)


def resistance(b, x):
    return b[0] * np.exp(b[1] / (x + b[2]))


PROBLEMS = {
    "Misra1a": Certified(
        exponential_rise,
        ((500.0, 0.0001), (250.0, 0.0005)),
        (238.94212918, 0.00055015643181),
        (2.7070075241, 7.2668688436e-06),
        0.12455138894,
        (10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.4, 75.47, 81.78),
        (77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0),
    ),
    "Thurber": Certified(
        cubic_over_cubic,
        ((1000.0, 1000.0, 400.0, 40.0, 0.7, 0.3, 0.03), (1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05)),
        (1288.13968, 1491.0792535, 583.23836877, 75.416644291, 0.96629502864, 0.39797285797, 0.049727297349),
        (
            4.6647963344,
            39.571156086,
            28.698696102,
            5.567537027,
            0.031333340687,
            0.014984928198,
            0.0065842344623,
        ),
        5642.7082397,
        (
            80.574,
            84.248,
            87.264,
            87.195,
            89.076,
            89.608,
            89.868,
            90.101,
            92.405,
            95.854,
            100.696,
            101.06,
            401.672,
            390.724,
            567.534,
            635.316,
            733.054,
            759.087,
            894.206,
            990.785,
            1090.109,
            1080.914,
            1122.643,
            1178.351,
            1260.531,
            1273.514,
            1288.339,
            1327.543,
            1353.863,
            1414.509,
            1425.208,
            1421.384,
            1442.962,
            1464.35,
            1468.705,
            1447.894,
            1457.628,
        ),
        (
            -3.067,
            -2.981,
            -2.921,
            -2.912,
            -2.84,
            -2.797,
            -2.702,
            -2.699,
            -2.633,
            -2.481,
            -2.363,
            -2.322,
            -1.501,
            -1.46,
            -1.274,
            -1.212,
            -1.1,
            -1.046,
            -0.915,
            -0.714,
            -0.566,
            -0.545,
            -0.4,
            -0.309,
            -0.109,
            -0.103,
            0.01,
            0.119,
            0.377,
            0.79,
            0.963,
            1.006,
            1.115,
            1.572,
            1.841,
            2.047,
            2.2,
        ),
    ),
    "Rat43": Certified(
        richards,
        ((100.0, 10.0, 1.0, 1.0), (700.0, 5.0, 0.75, 1.3)),
        (699.6415127, 5.2771253025, 0.75962938329, 1.2792483859),
        (16.302297817, 2.0828735829, 0.19566123451, 0.68761936385),
        8786.404908,
        (
            16.08,
            33.83,
            65.8,
            97.2,
            191.55,
            326.2,
            386.87,
            520.53,
            590.03,
            651.92,
            724.93,
            699.56,
            689.96,
            637.56,
            717.41,
        ),
        (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0),
    ),
    "BoxBOD": Certified(
        exponential_rise,
        ((1.0, 1.0), (100.0, 0.75)),
        (213.80940889, 0.54723748542),
        (12.354515176, 0.10455993237),
        1168.0088766,
        (109.0, 149.0, 149.0, 191.0, 213.0, 224.0),
        (1.0, 2.0, 3.0, 5.0, 7.0, 10.0),
    ),
    "MGH09": Certified(
        kowalik_osborne,
        ((25.0, 39.0, 41.5, 39.0), (0.25, 0.39, 0.415, 0.39)),
        (0.19280693458, 0.19128232873, 0.12305650693, 0.13606233068),
        (0.011435312227, 0.19633220911, 0.080842031232, 0.090025542308),
        0.00030750560385,
        (0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246),
        (4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625),
    ),
    "Eckerle4": Certified(
        peak,
        ((1.0, 10.0, 500.0), (1.5, 5.0, 450.0)),
        (1.5543827178, 4.0888321754, 451.54121844),
        (0.015408051163, 0.046803020753, 0.046800518816),
        0.0014635887487,
        (
            0.0001575,
            0.0001699,
            0.000235,
            0.0003102,
            0.0004917,
            0.000871,
            0.0017418,
            0.00464,
            0.0065895,
            0.0097302,
            0.0149002,
            0.023731,
            0.0401683,
            0.0712559,
            0.1264458,
            0.2073413,
            0.2902366,
            0.3445623,
            0.3698049,
            0.3668534,
            0.3106727,
            0.2078154,
            0.1164354,
            0.0616764,
            0.03372,
            0.0194023,
            0.0117831,
            0.0074357,
            0.0022732,
            0.00088,
            0.0004579,
            0.0002345,
            0.0001586,
            0.0001143,
            7.1e-05,
        ),
        (
            400.0,
            405.0,
            410.0,
            415.0,
            420.0,
            425.0,
            430.0,
            435.0,
            436.5,
            438.0,
            439.5,
            441.0,
            442.5,
            444.0,
            445.5,
            447.0,
            448.5,
            450.0,
            451.5,
            453.0,
            454.5,
            456.0,
            457.5,
            459.0,
            460.5,
            462.0,
            463.5,
            465.0,
            470.0,
            475.0,
            480.0,
            485.0,
            490.0,
            495.0,
            500.0,
        ),
    ),
    "MGH10": Certified(
        resistance,
        ((2.0, 400000.0, 25000.0), (0.02, 4000.0, 250.0)),
        (0.005609636471, 6181.3463463, 345.22363462),
        (0.00015687892471, 23.309021107, 0.78486103508),
        87.945855171,
        (
            34780.0,
            28610.0,
            23650.0,
            19630.0,
            16370.0,
            13720.0,
            11540.0,
            9744.0,
            8261.0,
            7030.0,
            6005.0,
            5147.0,
            4427.0,
            3820.0,
            3307.0,
            2872.0,
        ),
        (
            50.0,
            55.0,
            60.0,
            65.0,
            70.0,
            75.0,
            80.0,
            85.0,
            90.0,
            95.0,
            100.0,
            105.0,
            110.0,
            115.0,
            120.0,
            125.0,
        ),
    ),
}


def matching_digits(found: float, certified: float) -> float:
    return min(11.0, -np.log10(max(abs(found / certified - 1.0), 1e-16)))


def problem_from(name: str, start: int) -> Problem:
    certified = PROBLEMS[name]
    x, y = np.array(certified.x), np.array(certified.y)

    def residual(b):
        return y - certified.model(b, x)

    def linearise(b):
        step = 1e-30
        slopes = [certified.model(b + step * 1j * unit, x).imag / step for unit in np.eye(b.size)]
        return residual(b), -np.stack(slopes, axis=1)

    start_values = certified.starts[start]
    names = [f"b{i + 1}" for i in range(len(start_values))]
    return Problem(
        Parameters(Parameter(n, "", v) for n, v in zip(names, start_values, strict=True)), linearise, residual
    )


FAR_STARTS = [("BoxBOD", 0), ("MGH10", 0)]
"""From these Levenberg-Marquardt runs into a flat region, as do MINPACK and others: the business of several starts."""


@pytest.mark.parametrize(
    ("name", "start"),
    [(name, start) for name in PROBLEMS for start in (0, 1) if (name, start) not in FAR_STARTS],
)
def test_certified_values_and_standard_deviations(name, start):
    certified = PROBLEMS[name]
    estimate = solve(problem_from(name, start), max_iterations=2000)
    assert estimate.converged, estimate.message
    assert estimate.degrees_of_freedom == len(certified.y) - len(certified.values)
    assert matching_digits(estimate.chi2, certified.sum_of_squares) > 8
    stds = np.sqrt(np.diag(estimate.covariance) * estimate.reduced_chi2)
    for found, std, value, certified_std in zip(
        estimate.values.values(), stds, certified.values, certified.stds, strict=True
    ):
        assert matching_digits(found, value) > 7
        assert matching_digits(std, certified_std) > 6


def test_multi_start_counts_the_starts_that_agree():
    problem = problem_from("Misra1a", 0)
    starts = np.array([PROBLEMS["Misra1a"].starts[0], PROBLEMS["Misra1a"].starts[1], (240.0, np.nan)])
    estimate = solve(problem, starts=starts)
    assert "2 of 3 starts reached this optimum" in estimate.message
    assert "at 1 the model could not be evaluated" in estimate.message


@pytest.mark.parametrize("name", ["BoxBOD", "MGH10"])
def test_multi_start_rescues_a_far_start(name):
    certified = PROBLEMS[name]
    estimate = solve(problem_from(name, 0), starts=np.array(certified.starts))
    assert estimate.converged
    assert "1 of 2 starts" in estimate.message
    assert matching_digits(estimate.chi2, certified.sum_of_squares) > 8
