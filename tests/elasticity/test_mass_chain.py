"""Chains of masses: response against matrices, synthesis from resonances, and intervals that cover."""

from __future__ import annotations

import numpy as np
import pytest
from axis_simulator import DAMPINGS, INERTIAS, STEP, STIFFNESSES, VISCOUS, Axis, chirp, multisine
from over_seeds import over_seeds

from flexcal.elasticity.modal import antiresonances, identify_masses, identify_modes, resonances
from flexcal.elasticity.modal.mass_chain import MassChain, synthesise
from flexcal.frequency.arbitrary import (
    Channel,
    ExcitationRecord,
    equal_pieces,
    excited_band,
    find_period,
    local_response,
    record_spectra,
)


def test_the_response_is_that_of_the_matrices() -> None:
    chain = MassChain(np.array(INERTIAS), np.array(STIFFNESSES), np.array(DAMPINGS), VISCOUS)
    frequencies = np.geomspace(0.5, 80, 30)
    np.testing.assert_allclose(chain.response(frequencies), Axis().response(frequencies)[:, 0], rtol=1e-10)


def test_a_chain_is_found_from_its_resonances_and_antiresonances() -> None:
    axis = Axis(dampings=(1e-9, 1e-9), viscous=0.0)
    chain = synthesise(2.0, 2 * np.pi * axis.resonances[0], 2 * np.pi * axis.antiresonances[0])
    np.testing.assert_allclose(chain.inertias, INERTIAS, rtol=1e-6)
    np.testing.assert_allclose(chain.stiffnesses, STIFFNESSES, rtol=1e-6)


def test_only_what_repeats_has_a_period() -> None:
    generator = np.random.default_rng(1)
    tiled = np.tile(multisine(500, range(2, 60), generator), 5)[:, None]
    assert find_period(tiled + 0.1 * tiled.std() * generator.normal(size=tiled.shape)) == 500
    assert find_period(generator.normal(size=(4000, 1))) is None
    assert find_period(chirp(4000, 0.5, 30.0, 1.0)[:, None]) is None


def quantities_inside(seed: int, axis: Axis, truth: dict[str, float], kind: str) -> list[bool]:
    """Whether what one record tells lies in its intervals."""
    generator, samples = np.random.default_rng(seed), 6000
    torque = chirp(samples, 1.0, 40.0, 20.0) if kind == "sweep" else 20 * generator.normal(size=samples)
    disturbance = np.zeros(samples)
    for i in range(1, samples):
        disturbance[i] = 0.95 * disturbance[i - 1] + 0.5 * generator.normal()
    _, q = axis.run(torque + disturbance)
    seen = q[:, :1] + 2e-5 * generator.normal(size=(samples, 1))
    record = ExcitationRecord("record", STEP, torque[:, None], seen, np.zeros((samples, 0)))
    whole, _ = record_spectra(equal_pieces([record]), [Channel("u", "N m")], [Channel("q", "rad")])
    band = excited_band(whole, local_response(whole))
    assert band is not None
    spectra = whole.between(*band)
    found = identify_modes(spectra, local_response(spectra))
    values = [(r.frequency_hz, f) for r, f in zip(resonances(found.fit), axis.resonances[0], strict=True)]
    values += [
        (r.frequency_hz, f)
        for r, f in zip(antiresonances(found.fit, 0, 0), axis.antiresonances[0], strict=True)
    ]
    masses = identify_masses(found.fit, found.response)
    if masses.chosen is not None:
        values += [(masses.chosen.values()[name], value) for name, value in truth.items()]
    return [value.interval[0] <= true <= value.interval[1] for value, true in values]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sweep", "noise"])
def test_intervals_cover(kind: str) -> None:
    """A two-mass axis of one short record, with encoder noise and a disturbance torque that has memory; 95 % intervals of 40 seeds."""
    axis = Axis(inertias=(2.0, 3.0), stiffnesses=(9e3,), dampings=(6.0,))
    truth = {"inertia_1": 2.0, "inertia_2": 3.0, "stiffness_1": 9e3}
    inside = np.concatenate(over_seeds(quantities_inside, range(200, 240), axis, truth, kind))
    assert len(inside) >= 180
    assert 0.88 <= np.mean(inside) <= 0.995
