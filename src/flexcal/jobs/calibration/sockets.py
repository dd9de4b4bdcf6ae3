"""Remarks on measurements with a ball in sockets: agreement of the places, and what they cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.calibration.diagnostics import FEWEST_PLACES, PlaceAgreement, PlaceErrors
from flexcal.calibration.fit import GeometricFit
from flexcal.model.robot import GEOMETRY
from flexcal.report.results import chance_in_words
from flexcal.units import MILLIMETRE


def base_remark(fit: GeometricFit) -> tuple[str, ...]:
    """Remark on what the places of a fixture cannot tell, and on how many of the robot's own parameters they do."""
    if not fit.poses.in_socket.all():
        return ()
    seen = fit.identifiability
    blind = [item.name for item in seen.dropped if not item.absorbed_by]
    every = [
        name
        for name in seen.names
        if name.rpartition(".")[2] in GEOMETRY and not name.startswith("station.") and name not in blind
    ]
    kept = [name for name in seen.kept_names if name in every]
    held = sum(item.name in kept for item in fit.undetermined)
    owners = dict.fromkeys(joint.name for joint in fit.model.joints if f"{joint.name}.length_x" in every)
    lost = [f"{owner}.{key}" for owner in owners for key in GEOMETRY if f"{owner}.{key}" not in every]
    hidden = f", of which {held} are hidden by the scatter" if held else ""
    return (
        f"of {len(every) + len(lost)} parameters of the robot itself {len(kept)} combinations are seen{hidden}; where its base stands "
        f"cannot be told, so nothing is claimed of what moves the whole robot: {', '.join(lost)}. Parameters station.PLACE.… are where "
        "the fixture stood",
    )


def place_remarks(agreement: PlaceAgreement | None) -> tuple[str, ...]:
    """Remarks on places of the fixture that disagree with the others, one sentence a place."""
    if agreement is None:
        return ()
    if not agreement.judged:
        worst = agreement.inconsistent
        if worst is not None:
            return (
                f"the {len(agreement.places)} places of the fixture are not consistent with one robot: predicted from the others, "
                f"{worst.name} has {worst.ratio:.1f} times the squared errors that their scatter lets expect ({chance_in_words(worst.p)}). "
                "Which place is wrong, or whether the arm errs beyond its model, cannot be told; measure "
                f"at {FEWEST_PLACES} places or more",
            )
        return (
            f"with {len(agreement.places)} places of the fixture, one that disagrees with the others could not be told from them; measure "
            f"at {FEWEST_PLACES} or more",
        )
    others = [place for place in agreement.places if place.name not in agreement.suspects]
    by_name = {place.name: place for place in agreement.places}
    remarks = [_disagrees(agreement, by_name[name], others) for name in agreement.suspects]
    if remarks:
        remarks.append(
            "places that disagree are in the fit, their outliers with small weights: look whether ball and fixture sat firmly there, "
            "measure again, or take these rows out of the file and compare"
        )
    return tuple(remarks)


def _disagrees(agreement: PlaceAgreement, place: PlaceErrors, others: Sequence[PlaceErrors]) -> str:
    own = [item for item in agreement.disagreements if item.place == place.name]
    parts = []
    for pair in sorted({item.pair for item in own if item.pair is not None}):
        off = place.distances[pair]
        usual = [other.distances[pair] / MILLIMETRE for other in others if pair in other.distances]
        parts.append(
            f"its sockets {pair[0]} and {pair[1]} are {abs(off) / MILLIMETRE:.2f} mm {'farther apart' if off > 0 else 'closer'} than "
            f"declared, those of the others by {min(usual):+.2f} to {max(usual):+.2f} mm"
        )
    errors = [other.error for other in others]
    if place.error > max(errors):
        parts.append(
            f"predicted without it, its mean error is {place.error / MILLIMETRE:.2f} mm, at the others "
            f"{min(errors) / MILLIMETRE:.2f} to {max(errors) / MILLIMETRE:.2f} mm"
        )
    if any(item.what == "outliers" for item in own):
        elsewhere, rows = sum(other.outliers for other in others), sum(other.poses for other in others)
        parts.append(
            f"{place.outliers} of its {place.poses} poses are outliers, {elsewhere} of {rows} at the others"
        )
    p = min(item.p for item in own)
    return f"the place {place.name} disagrees with the other {len(others)}: {'; '.join(parts)} ({chance_in_words(p)})"
