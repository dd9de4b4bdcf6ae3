"""The check of measurements with a ball in the sockets of a fixture: whether its places agree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from flexcal.report.layout import Check, document_millimetres, p_value


def check_places(places: Mapping[str, Any]) -> Check:
    """Whether every place of the fixture agrees with the others; `places` is the block of results.json."""
    question = "Do the places of the fixture agree?"
    errors = {name: place["mean_mm"] for name, place in places["places"].items()}
    said = f"Predicted from the others, the places have mean errors of {_range(errors.values())} mm"
    if places["inconsistent"] is not None:
        worst = places["places"][places["inconsistent"]]
        answer = (
            f"No: the squared errors at {places['inconsistent']}, predicted from the others, are {worst['ratio']:.1f} times what these let "
            f"expect (p = {p_value(worst['p'])}). {said}."
        )
        return Check(question, answer, "care", "one_robot")
    if not places["judged"]:
        answer = f"Cannot be judged: with {len(errors)} places the one that is wrong cannot be told from the others. {said}."
        return Check(question, answer, "unknown", "places")
    disagree = places["disagree"]
    if not disagree:
        return Check(question, f"{said}, and none stands out.", "good", "places")
    suspects = list(dict.fromkeys(item["place"] for item in disagree))
    others = [error for name, error in errors.items() if name not in suspects]
    own = ", ".join(f"{name} {document_millimetres(errors[name])} mm" for name in suspects)
    chance = p_value(max(min(i["p"] for i in disagree if i["place"] == name) for name in suspects))
    verb = "disagrees" if len(suspects) == 1 else "disagree"
    answer = (
        f"No: {' and '.join(suspects)} {verb} with the others (p = {chance}). Predicted from these, the mean error is {own}, and "
        f"{_range(others)} mm at the others; the remarks say what differs."
    )
    return Check(question, answer, "care", "places")


def _range(errors: Iterable[float]) -> str:
    """Smallest and largest of some lengths, mm."""
    known = sorted(errors)
    return f"{document_millimetres(known[0])} to {document_millimetres(known[-1])}"
