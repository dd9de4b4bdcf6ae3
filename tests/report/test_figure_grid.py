"""Grids of panels, lines and axes of a figure, against Plotly's own."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.subplots import make_subplots

from flexcal.report.layout import Figure, panels, trace

TITLES = ["a", "b", "", "d", "e", "f"]


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (3, 1), (1, 3), (2, 3), (7, 6)])
def test_panels_stand_where_plotly_puts_them(rows: int, columns: int) -> None:
    ours = json_of(panels(rows, columns, 400, TITLES, row_gap=0.04, column_gap=0.03))["layout"]
    gaps = {"vertical_spacing": 0.04 if rows > 1 else 0.0, "horizontal_spacing": 0.03 if columns > 1 else 0.0}
    titles = (TITLES + [""] * rows * columns)[: rows * columns]
    theirs = json.loads(str(make_subplots(rows, columns, subplot_titles=titles, **gaps).to_json()))["layout"]
    axes = [name for name in theirs if "axis" in name]
    assert sorted(name for name in ours if "axis" in name) == sorted(axes)
    for name in axes:
        assert ours[name]["anchor"] == theirs[name]["anchor"]
        np.testing.assert_allclose(ours[name]["domain"], theirs[name]["domain"], rtol=0, atol=1e-12)
    places = [[(t["text"], t["x"], t["y"], t["xanchor"]) for t in of["annotations"]] for of in (ours, theirs)]
    assert [p[0] for p in places[0]] == [p[0] for p in places[1]]
    np.testing.assert_allclose([p[1:3] for p in places[0]], [p[1:3] for p in places[1]], rtol=0, atol=1e-12)


def test_traces_lines_and_axes_are_those_of_plotly() -> None:
    """Lines in the panels that have traces, properties of all axes, of a row and of one panel, and one that is removed again."""
    values = np.array([1.0, np.nan, 3.0], dtype=np.float32)
    ours, theirs = Figure(2, 2), make_subplots(2, 2)
    ours.add_trace(trace("scatter", x=values, y=[1, 2, 3], name=None, line={"color": "red"}), row=1, col=2)
    theirs.add_trace(go.Scatter(x=values, y=[1, 2, 3], name=None, line={"color": "red"}), row=1, col=2)
    ours.add_trace(trace("heatmap", z=np.ones((2, 3), dtype=np.float32)), 2, 1)
    theirs.add_trace(go.Heatmap(z=np.ones((2, 3), dtype=np.float32)), 2, 1)
    for figure in (ours, theirs):
        figure.add_vline(x=2.5, line={"color": "blue", "width": 1})
        figure.add_hline(y=-1, line={"dash": "dot"})
        figure.update_xaxes({"type": "log"}, nticks=5, title_text="x / m", row=1)
        figure.update_yaxes(matches="y", title_text="y / m")
        figure.update_yaxes(title={"font": {"size": 12}}, row=1, col=1)
        figure.update_yaxes(matches=None, row=2, col=2)
        figure.update_layout(margin={"l": 1}, legend={"x": 0})
        figure.update_layout(margin={"r": 2})
    expected = json.loads(str(theirs.to_json()))
    expected["layout"].pop("template")
    found = json_of(ours)
    for name in [name for name in expected["layout"] if "axis" in name]:  # `panels` gives them
        places = {key: expected["layout"][name][key] for key in ("anchor", "domain")}
        found["layout"][name] = places | found["layout"].get(name, {})
    assert found == expected


def test_what_json_has_not_is_written_as_plotly_writes_it() -> None:
    """NumPy's scalars, numbers without a value, whole numbers of 64 bits, and none at all."""
    figure = Figure()
    y = np.array([1, 2, 3])
    figure.add_trace(
        trace("bar", x=[np.float64(1.5), float("nan"), 2], y=y, text=("a", "b"), width=np.int64(3))
    )
    figure.add_trace(trace("bar", x=np.zeros(0, dtype=np.float32)))
    assert json_of(figure)["data"] == [
        {"type": "bar", "x": [1.5, None, 2], "y": [1, 2, 3], "text": ["a", "b"], "width": 3},
        {"type": "bar", "x": []},
    ]
    np.testing.assert_array_equal(figure.plotly().data[0].y, y)


def test_plotly_refuses_what_it_does_not_know() -> None:
    figure = Figure()
    figure.add_trace(trace("scatter", colour="red"))
    with pytest.raises(ValueError, match="colour"):
        figure.plotly()


def json_of(figure: Figure) -> dict[str, Any]:
    """Data and layout as a page has them."""
    return json.loads(json.dumps(figure.specification()))
