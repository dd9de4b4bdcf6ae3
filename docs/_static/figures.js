"use strict";
// Draws the figures that the notebooks left as data, in the colours of the page's ground. Plotly is loaded where there are any.
(function () {
  const here = document.currentScript.src;
  const scheme = window.matchMedia("(prefers-color-scheme: dark)");
  const config = { displaylogo: false, plotlyServerURL: "", responsive: true, displayModeBar: "hover" };
  const flatButtons = [["toImage", "zoom2d", "pan2d", "resetScale2d"]];
  const spaceButtons = [["toImage", "resetCameraDefault3d"]];

  function recoloured(value, dark) {
    if (typeof value === "string") return dark[value] || value;
    if (Array.isArray(value)) return value.map((item) => recoloured(item, dark));
    if (value && typeof value === "object") {
      return Object.fromEntries(
        Object.entries(value).map(([key, item]) => [key, key === "bdata" ? item : recoloured(item, dark)]),
      );
    }
    return value;
  }

  function isDark() {
    const theme = document.body.dataset.theme;
    return theme === "dark" || (theme !== "light" && scheme.matches);
  }

  function start() {
    const figures = [...document.querySelectorAll(".plotly-figure")].map(function (place) {
      return { place: place, drawing: JSON.parse(place.firstElementChild.textContent) };
    });
    if (!figures.length) return;

    function draw() {
      for (const { place, drawing } of figures) {
        const shown = isDark() ? recoloured(drawing, drawing.dark) : drawing;
        const buttons = drawing.layout.scene ? spaceButtons : flatButtons;
        Plotly.react(place, shown.data, shown.layout, Object.assign({ modeBarButtons: buttons }, config));
      }
    }

    const program = document.createElement("script");
    program.src = new URL("plotly.min.js", here).href;
    program.addEventListener("load", function () {
      draw();
      scheme.addEventListener("change", draw);
      new MutationObserver(draw).observe(document.body, { attributeFilter: ["data-theme"] });
    });
    document.head.append(program);
  }

  document.addEventListener("DOMContentLoaded", start);
})();
