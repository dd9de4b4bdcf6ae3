"""Frequency response with covariances, 6×6, 4 realisations × 4 periods × 1000 lines, against loops over blocks and lines."""

import time
from collections.abc import Sequence

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.frequency.periodic import multisine_spectra, pose_response, synthesise

AXES, REALISATIONS, PERIODS, SETTLE, LINES = 6, 4, 4, 2, 1000
BASE_HZ, RATE_HZ = 0.25, 4000.0


def run() -> list[tuple[str, float, str]]:
    """Ratios (name, times faster, note): the same records, the same covariance of the mean and of the noise."""
    plan, recordings = experiment(np.random.default_rng(3))
    ours = min(_seconds(lambda: pose_response(plan, 0, recordings)) for _ in range(3))
    results = []
    for name, transform in (("a DFT per line", dft_per_line), ("an FFT per block", fft_per_block)):
        naive = _seconds(lambda t=transform: loop(plan, recordings, t))
        results.append(
            (f"frequency response, loops with {name}", naive / ours, f"{naive:.2f} s against {ours:.3f} s")
        )
    response = pose_response(plan, 0, recordings).response
    assert np.allclose(response, loop(plan, recordings, fft_per_block)[0], rtol=1e-8)
    return results


def experiment(rng: np.random.Generator) -> tuple[MultisinePlan, list[Recording]]:
    """Records of a stiff mass matrix with noise: what is timed does not depend on the plant."""
    lines = 2 * np.arange(LINES) + 13
    plan = MultisinePlan(
        name="benchmark",
        poses=np.zeros((1, AXES)),
        joints=tuple(range(AXES)),
        payload=None,
        base_frequency_hz=BASE_HZ,
        lines=lines,
        detection_lines=np.array([], int),
        amplitude=np.ones((AXES, LINES)),
        periods=PERIODS,
        settle_periods=SETTLE,
        realisations=REALISATIONS,
        signs=True,
        reference_amplitude=0.0,
        reference_frequency_hz=2.125,
        kp=np.zeros(AXES),
        kd=np.zeros(AXES),
        rate_hz=RATE_HZ,
        torque="instantaneous",
        seed=1,
    )
    mass = np.diag(np.linspace(20.0, 1.0, AXES)) + 0.3
    omega = 2.0 * np.pi * BASE_HZ * lines
    period = round(RATE_HZ / BASE_HZ)
    recordings = []
    for realisation in range(REALISATIONS):
        phasors = multisine_spectra(plan, realisation)
        for e in range(AXES):
            motion = -np.linalg.solve(mass, phasors[:, :, e].T).T / omega[:, None] ** 2
            for sign in (1, -1):
                torque = np.tile(sign * synthesise(phasors[:, :, e], lines, period), (PERIODS, 1))
                q = np.tile(sign * synthesise(motion, lines, period), (PERIODS, 1))
                q += 1e-8 * rng.standard_normal(q.shape)
                label = RecordingLabel(0, realisation, e, sign)
                recordings.append(
                    Recording(time_step=1.0 / RATE_HZ, q=q, torque=torque, arm=None, start=0.0, label=label)
                )
    return plan, recordings


def dft_per_line(signal: np.ndarray, lines: Sequence[int]) -> np.ndarray:
    """Phasors (L, columns) of one period, line by line from the definition."""
    turn = -2j * np.pi / signal.shape[0] * np.arange(signal.shape[0])
    return np.array([np.exp(turn * line) @ signal for line in lines]) * (2.0 / signal.shape[0])


def fft_per_block(signal: np.ndarray, lines: Sequence[int]) -> np.ndarray:
    """The same by one FFT of the period."""
    return np.fft.fft(signal, axis=0)[np.asarray(lines)] * (2.0 / signal.shape[0])


def loop(
    plan: MultisinePlan, recordings: list[Recording], transform
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As one writes it first: for every period, record and line; returns Ĝ and total and noise covariance of vec Ĝ."""
    n, period = len(plan.joints), round(plan.rate_hz / plan.base_frequency_hz)
    blocks = {}
    for record in recordings:
        spectra = []
        for p in range(plan.settle_periods, plan.periods):
            rows = slice(p * period, (p + 1) * period)
            spectra.append(transform(np.hstack([record.q[rows], record.torque[rows]]), plan.lines))
        label = record.label
        assert label is not None
        blocks[label.realisation, label.experiment, label.sign] = np.mean(spectra, axis=0)
    responses = np.zeros((plan.realisations, len(plan.lines), n, n), complex)
    noise = np.zeros((len(plan.lines), n * n, n * n), complex)
    for k, line in enumerate(plan.lines):
        minus_square = -((2.0 * np.pi * plan.base_frequency_hz * line) ** 2)
        for r in range(plan.realisations):
            columns, sums = [], []
            for e in range(n):
                plus, minus = blocks[r, e, 1][k], blocks[r, e, -1][k]
                columns.append((plus - minus) / 2.0)
                sums.append((plus + minus) / 2.0)
            matrix, empty = np.array(columns).T, np.array(sums).T
            inverse = np.linalg.inv(matrix[n:])
            responses[r, k] = minus_square * matrix[:n] @ inverse
            left = np.hstack([minus_square * np.eye(n), -responses[r, k]])
            error = left @ (empty @ empty.conj().T / n) @ left.conj().T
            noise[k] += np.kron(inverse.T @ inverse.conj(), error) / plan.realisations**2
    mean = responses.mean(axis=0)
    total = np.zeros_like(noise)
    for k in range(len(plan.lines)):
        first = min(max(k - 7, 0), len(plan.lines) - 15)
        pooled = np.zeros((n * n, n * n), complex)
        for j in range(first, first + 15):
            for r in range(plan.realisations):
                scatter = ((responses[r, j] - mean[j]) / np.abs(mean[j])).flatten(order="F")
                pooled += np.outer(scatter, scatter.conj())
        scale = np.abs(mean[k]).flatten(order="F")
        total[k] = pooled / (15 * (plan.realisations - 1)) * np.outer(scale, scale) / plan.realisations
    return mean, total, noise


def _seconds(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    for name, ratio, note in run():
        print(f"{name}: {ratio:.1f}× ({note})")
