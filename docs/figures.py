"""Run in every notebook's kernel before its first cell: figures become data in the page, which `_static/figures.js` draws."""

from plotly import io
from plotly.io.base_renderers import MimetypeRenderer

from flexcal.report.layout.palette import dark_colours
from flexcal.report.layout.rendering import script_json


class PageRenderer(MimetypeRenderer):
    """A figure as JSON inside an element of its height; Plotly itself is loaded once by the page."""

    def to_mimebundle(self, fig_dict: dict) -> dict[str, str]:
        layout = {key: value for key, value in fig_dict["layout"].items() if key != "template"}
        drawing = script_json({"data": fig_dict["data"], "layout": layout, "dark": dark_colours()})
        height = layout.get("height", 400)
        script = f'<script type="application/json">{drawing}</script>'
        return {"text/html": f'<div class="plotly-figure" style="height: {height}px">{script}</div>'}


io.renderers["page"] = PageRenderer()
io.renderers.default = "page"
