"use strict";
// Words and tables are painted first; then Plotly, which is carried as plain text, is run and the figures are drawn one by one.
(function () {
  const dark = JSON.parse(document.getElementById("dark-colours").textContent);
  const scheme = window.matchMedia("(prefers-color-scheme: dark)");
  // Buttons by name: the default ones would offer to send the data to a server.
  const config = { displaylogo: false, plotlyServerURL: "" };
  const flatButtons = [["toImage", "zoom2d", "pan2d", "resetScale2d"]];
  const spaceButtons = [["toImage", "zoom3d", "pan3d", "orbitRotation", "resetCameraDefault3d"]];
  const figures = new Map();
  // Figures in space need WebGL, which remote desktops and locked-down browsers lack.
  const webgl = Boolean(document.createElement("canvas").getContext("webgl"));
  let printing = false;
  const widths = new ResizeObserver(function (entries) {
    for (const entry of entries) {
      const place = entry.target;
      const width = place._fullLayout ? place._fullLayout.width : Number(place.dataset.width || place.clientWidth);
      if (Math.abs(width - place.clientWidth) > 1) setTimeout(() => draw(place.id), 0);
    }
  });

  function recoloured(value) {
    if (typeof value === "string") return dark[value] || value;
    if (ArrayBuffer.isView(value)) return value;
    if (Array.isArray(value)) return value.map(recoloured);
    if (value && typeof value === "object") {
      return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, key === "bdata" ? item : recoloured(item)]));
    }
    return value;
  }

  function shown(figure) {
    return figure.data.map(function (trace) {
      const meta = trace.meta || {};
      const visible = Object.entries(figure.selected).every(([key, option]) => !(key in meta) || meta[key] === option);
      const drawn = Object.assign({}, trace, { visible: visible });
      return visible && meta.exaggeration ? stretched(drawn, figure.factors[meta[figure.stretched_by]] / meta.exaggeration) : drawn;
    });
  }

  // Arrows as long as the slider says: lines are tip, end, gap; cones stand at the end and carry their arrow.
  function stretched(trace, ratio) {
    const changed = {};
    for (const [place, along] of [["x", "u"], ["y", "v"], ["z", "w"]]) {
      const from = numbers(trace[place]);
      if (along in trace) {
        const arrow = numbers(trace[along]);
        changed[place] = from.map((end, k) => end + (ratio - 1) * arrow[k]);
        changed[along] = arrow.map((part) => ratio * part);
      } else {
        changed[place] = from.map((value, k) => (k % 3 === 1 ? from[k - 1] + ratio * (value - from[k - 1]) : value));
      }
    }
    return Object.assign(trace, changed);
  }

  const numbers = flexcalNumbers;

  function showFactor(slider) {
    const figure = figures.get(slider.dataset.figure);
    const factors = slider.dataset.factors.split(" ").map(Number);
    const factor = figure.factors[figure.selected[figure.stretched_by]];
    slider.value = factors.indexOf(factor);
    slider.setAttribute("aria-valuetext", factor + " times");
    slider.parentElement.querySelector("output").value = "× " + factor;
  }

  function draw(id) {
    const figure = figures.get(id);
    const place = document.getElementById(id);
    const narrow = place.clientWidth < 560;
    let layout = Object.assign({}, figure.layout);
    if (narrow) {
      layout.font = Object.assign({}, layout.font, { size: 11 });
      layout.margin = Object.assign({}, layout.margin, { l: Math.min(layout.margin.l, 44), r: 6 });
      layout.dragmode = layout.scene ? layout.dragmode : false;
      if (layout.scene) {
        const eye = layout.scene.camera.eye;
        const farther = { x: 1.45 * eye.x, y: 1.45 * eye.y, z: 1.45 * eye.z };
        layout.scene = Object.assign({}, layout.scene, { camera: Object.assign({}, layout.scene.camera, { eye: farther }) });
      }
    }
    let data = shown(figure);
    if (scheme.matches && !printing) {
      data = recoloured(data);
      layout = recoloured(layout);
    }
    const waiting = place.querySelector(".waiting");
    if (waiting) waiting.remove();
    if (layout.scene && !webgl) {
      place.dataset.width = place.clientWidth;
      drawFlat(place, data, layout);
      return Promise.resolve();
    }
    const drawn = Plotly.react(place, data, layout, Object.assign({}, config, {
      displayModeBar: narrow ? false : "hover",
      modeBarButtons: layout.scene ? spaceButtons : flatButtons,
    }));
    return drawn.then(function () {
      // the words about the figure say what a listener needs; ticks read out one by one do not
      for (const picture of place.querySelectorAll(".svg-container svg, .svg-container canvas")) picture.setAttribute("aria-hidden", "true");
      makeRoom(place, layout);
    });
  }

  // The legend stands above the figure in as many rows as it needs; the titles of panels stand between.
  function makeRoom(place, layout) {
    const legend = place.querySelector("g.legend");
    if (!legend) return;
    const missing = Math.ceil(legend.getBBox().height) + 28 - layout.margin.t;
    if (missing > 0) Plotly.relayout(place, { "margin.t": layout.margin.t + missing, height: layout.height + missing });
  }

  // The wheel scrolls the page over a figure in space too; with Ctrl it zooms.
  function passWheel(place) {
    place.addEventListener("wheel", function (event) {
      if (!event.ctrlKey) event.stopPropagation();
    }, { capture: true, passive: true });
  }

  // A table that is cut says so in words where its shadow alone could be overlooked.
  function sayWide() {
    for (const region of document.querySelectorAll(".scroll")) {
      const wide = region.scrollWidth > region.clientWidth + 1;
      const said = region.nextElementSibling && region.nextElementSibling.classList.contains("sideways");
      if (wide && !said) {
        const hint = document.createElement("p");
        hint.className = "sideways";
        hint.textContent = "Wider than the screen: scroll the table sideways.";
        region.after(hint);
      } else if (!wide && said && region.clientWidth) {
        region.nextElementSibling.remove();
      }
    }
  }

  function drawAll() {
    for (const id of figures.keys()) draw(id);
  }

  function start() {
    const program = document.createElement("script");
    program.textContent = document.getElementById("plotly").textContent;
    if (!program.textContent) return;
    document.head.append(program);
    for (const holder of document.querySelectorAll("script[data-specification]")) {
      figures.set(holder.dataset.specification, JSON.parse(holder.textContent));
      const place = document.getElementById(holder.dataset.specification);
      widths.observe(place);
      if (figures.get(place.id).layout.scene) passWheel(place);
    }
    const waiting = [...figures.keys()];
    (function next() {
      if (!waiting.length) {
        document.documentElement.dataset.figures = "drawn";
        return;
      }
      draw(waiting.shift());
      setTimeout(next, 0);
    })();
    for (const choice of document.querySelectorAll("select[data-figure]")) {
      choice.addEventListener("change", function () {
        figures.get(choice.dataset.figure).selected[choice.dataset.key] = choice.value;
        for (const slider of document.querySelectorAll(`input[data-figure="${choice.dataset.figure}"]`)) showFactor(slider);
        draw(choice.dataset.figure);
      });
    }
    for (const slider of document.querySelectorAll("input[data-figure]")) {
      showFactor(slider);
      slider.addEventListener("input", function () {
        const figure = figures.get(slider.dataset.figure);
        figure.factors[figure.selected[figure.stretched_by]] = Number(slider.dataset.factors.split(" ")[slider.value]);
        showFactor(slider);
        draw(slider.dataset.figure);
      });
    }
    scheme.addEventListener("change", drawAll);
    window.addEventListener("beforeprint", function () {
      for (const folded of document.querySelectorAll("details")) folded.open = true;
      printing = true;
      if (scheme.matches) drawAll();
    });
    window.addEventListener("afterprint", function () {
      printing = false;
      if (scheme.matches) drawAll();
    });
  }

  const regions = new ResizeObserver(sayWide);
  for (const region of document.querySelectorAll(".scroll")) regions.observe(region);

  window.addEventListener("load", function () {
    // After the first frame; a page in the background draws no frames, there the timer starts.
    const timer = setTimeout(begin, 400);
    function begin() {
      clearTimeout(timer);
      if (!figures.size) start();
    }
    requestAnimationFrame(function () {
      setTimeout(begin, 0);
    });
  });
})();
