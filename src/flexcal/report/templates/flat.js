"use strict";
// A figure in space as a fixed parallel projection on a plain canvas, for browsers without WebGL: markers, lines, meshes and cones.
const drawFlat = (function () {
  const numbers = flexcalNumbers;
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((value) => value / Math.hypot(...a));
  const finite = (p) => p.every(Number.isFinite);
  const channels = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  const rgb = (values) => `rgb(${values.map((value) => Math.round(Math.max(0, Math.min(255, value)))).join()})`;

  function points(trace) {
    const [x, y, z] = ["x", "y", "z"].map((key) => numbers(trace[key]));
    return Array.from(x, (value, k) => [value, y[k], z[k]]);
  }

  function shade(scale, share) {
    const at = Math.max(0, Math.min(1, share));
    const next = Math.max(1, scale.findIndex(([place]) => place >= at));
    const [from, to] = [scale[next - 1], scale[next]];
    const part = (at - from[0]) / (to[0] - from[0]);
    const [low, high] = [channels(from[1]), channels(to[1])];
    return rgb(low.map((value, k) => value + part * (high[k] - value)));
  }

  function bounds(traces, scene) {
    return ["xaxis", "yaxis", "zaxis"].map(function (name, axis) {
      if (scene[name].range) return scene[name].range;
      const values = traces.flatMap((trace) => points(trace).map((p) => p[axis]).filter(Number.isFinite));
      const [low, high] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
      return low < high ? [low, high] : [low - 0.5, low + 0.5];
    });
  }

  // Everything to draw, with its depth: the far things first.
  function pieces(trace, to2d, towards) {
    const places = points(trace);
    const found = [];
    const opacity = trace.opacity === undefined ? 1 : trace.opacity;
    if (trace.type === "mesh3d") {
      const [i, j, k] = ["i", "j", "k"].map((key) => numbers(trace[key]));
      const base = channels(trace.color);
      for (let face = 0; face < i.length; face += 1) {
        const corners = [places[i[face]], places[j[face]], places[k[face]]];
        const normal = cross(corners[1].map((v, a) => v - corners[0][a]), corners[2].map((v, a) => v - corners[0][a]));
        const light = 0.72 + 0.28 * Math.abs(dot(unit(normal), unit([1, 2, 4])));
        const depth = corners.reduce((sum, p) => sum + dot(p, towards), 0) / 3;
        found.push({ depth, opacity, fill: rgb(base.map((value) => light * value)), outline: corners.map(to2d) });
      }
    } else if (trace.type === "cone") {
      const [u, v, w] = ["u", "v", "w"].map((key) => numbers(trace[key]));
      places.forEach(function (tip, row) {
        const [end, start] = [to2d(tip), to2d([tip[0] - u[row], tip[1] - v[row], tip[2] - w[row]])];
        const along = [end[0] - start[0], end[1] - start[1]].map((value) => trace.sizeref * value);
        const across = [-along[1] / 3, along[0] / 3];
        const back = [end[0] - along[0], end[1] - along[1]];
        const outline = [end, [back[0] + across[0], back[1] + across[1]], [back[0] - across[0], back[1] - across[1]]];
        found.push({ depth: dot(tip, towards), opacity, fill: trace.colorscale[0][1], outline });
      });
    } else if (trace.mode.includes("lines")) {
      for (let row = 1; row < places.length; row += 1) {
        const ends = [places[row - 1], places[row]];
        if (!ends.every(finite)) continue;
        const depth = (dot(ends[0], towards) + dot(ends[1], towards)) / 2;
        found.push({ depth, opacity, stroke: trace.line.color, width: trace.line.width / 2, outline: ends.map(to2d) });
      }
    }
    if (trace.mode && trace.mode.includes("markers")) {
      const marker = trace.marker;
      const graded = typeof marker.color === "string" ? null : numbers(marker.color);
      const sizes = typeof marker.size === "number" ? null : numbers(marker.size);
      places.forEach(function (place, row) {
        if (!finite(place)) return;
        const fill = graded ? shade(marker.colorscale, (graded[row] - marker.cmin) / (marker.cmax - marker.cmin)) : marker.color;
        found.push({ depth: dot(place, towards), opacity, fill, radius: (sizes ? sizes[row] : marker.size) / 2, at: to2d(place) });
      });
    }
    return found;
  }

  function paint(pen, piece) {
    pen.globalAlpha = piece.opacity;
    pen.beginPath();
    if (piece.at) pen.arc(piece.at[0], piece.at[1], piece.radius, 0, 2 * Math.PI);
    else piece.outline.forEach((p, k) => (k ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1])));
    if (piece.fill) {
      pen.fillStyle = piece.fill;
      pen.fill();
    } else {
      pen.strokeStyle = piece.stroke;
      pen.lineWidth = piece.width;
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  function steps([low, high]) {
    const rough = (high - low) / 4;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
    const ticks = [];
    for (let at = Math.ceil(low / step); at * step <= high; at += 1) ticks.push(Number((at * step).toPrecision(6)));
    return ticks;
  }

  // The three edges of the box that bear ticks, and the faint rest of it.
  function frame(pen, scene, box, to2d, towards) {
    const near = towards.map((part, axis) => box[axis][part > 0 ? 1 : 0]);
    const far = towards.map((part, axis) => box[axis][part > 0 ? 0 : 1]);
    const axes = ["xaxis", "yaxis", "zaxis"];
    for (let axis = 0; axis < 3; axis += 1) {
      const settings = scene[axes[axis]];
      const rest = axis === 2 ? [near[0], far[1], 0] : [near[0], near[1], box[2][0]];
      const [other, third] = [0, 1, 2].filter((k) => k !== axis);
      for (const a of box[other]) {
        for (const b of box[third]) {
          const ends = box[axis].map(function (value) {
            const corner = [0, 0, 0];
            corner[axis] = value; corner[other] = a; corner[third] = b;
            return to2d(corner);
          });
          if (a === near[other] && b === near[third]) continue;
          paint(pen, { opacity: 1, stroke: settings.gridcolor, width: 1, outline: ends });
        }
      }
      const place = (value) => to2d(rest.map((held, k) => (k === axis ? value : held)));
      const middle = to2d(box.map(([low, high]) => (low + high) / 2));
      const outwards = unit([place((box[axis][0] + box[axis][1]) / 2)[0] - middle[0], place((box[axis][0] + box[axis][1]) / 2)[1] - middle[1], 0]);
      pen.fillStyle = settings.color;
      pen.textAlign = outwards[0] > 0.3 ? "left" : outwards[0] < -0.3 ? "right" : "center";
      pen.textBaseline = "middle";
      for (const tick of steps(box[axis])) pen.fillText(String(tick), place(tick)[0] + 8 * outwards[0], place(tick)[1] + 10 * outwards[1]);
      const title = place((box[axis][0] + box[axis][1]) / 2);
      pen.fillText(settings.title.text, title[0] + 34 * outwards[0], title[1] + 28 * outwards[1]);
    }
  }

  function legend(pen, traces, ink, width) {
    let [left, top] = [8, 12];
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    for (const trace of traces) {
      if (!trace.name || trace.showlegend === false || trace.type === "cone") continue;
      const wide = pen.measureText(trace.name).width + 34;
      if (left + wide > width && left > 8) [left, top] = [8, top + 18];
      const own = [trace.color, trace.line && trace.line.color, trace.marker && trace.marker.color].find((c) => typeof c === "string");
      paint(pen, { opacity: 1, fill: own || ink, radius: 4, at: [left + 5, top] });
      pen.fillStyle = ink;
      pen.fillText(trace.name, left + 14, top);
      left += wide;
    }
  }

  function colourBar(pen, traces, ink, width, height) {
    const marker = traces.map((trace) => trace.marker).find((m) => m && m.colorbar);
    if (!marker) return;
    const [left, top, tall] = [width - 62, 0.2 * height, 0.6 * height];
    for (let row = 0; row < tall; row += 1) {
      pen.fillStyle = shade(marker.colorscale, 1 - row / tall);
      pen.fillRect(left, top + row, 12, 1.5);
    }
    pen.fillStyle = ink;
    pen.textAlign = "left";
    for (const share of [0, 0.5, 1]) {
      const value = marker.cmin + share * (marker.cmax - marker.cmin);
      pen.fillText(String(Number(value.toPrecision(2))), left + 17, top + (1 - share) * tall);
    }
    pen.textAlign = "right";
    pen.fillText(marker.colorbar.title.text, width - 4, top - 14);
  }

  return function (place, data, layout) {
    const [width, height] = [place.clientWidth, layout.height];
    const canvas = document.createElement("canvas");
    canvas.className = "flat";
    canvas.setAttribute("aria-hidden", "true");
    const fine = window.devicePixelRatio || 1;
    canvas.width = width * fine;
    canvas.height = height * fine;
    canvas.style.height = height + "px";
    const note = document.createElement("p");
    note.className = "no-webgl";
    note.textContent = "This browser has no WebGL: the figure is shown from one side and cannot be turned.";
    place.replaceChildren(note, canvas);
    const pen = canvas.getContext("2d");
    pen.scale(fine, fine);
    pen.font = `${layout.font.size}px ${layout.font.family}`;
    const traces = data.filter((trace) => trace.visible !== false);
    const eye = layout.scene.camera.eye;
    const towards = unit([eye.x, eye.y, eye.z]);
    const right = unit(cross([0, 0, 1], towards));
    const up = cross(towards, right);
    const box = bounds(traces, layout.scene);
    const corners = box[0].flatMap((x) => box[1].flatMap((y) => box[2].map((z) => [x, y, z])));
    const spans = [right, up].map((axis) => corners.map((p) => dot(p, axis)));
    const room = traces.some((trace) => trace.marker && trace.marker.colorbar) ? 130 : 60;
    const size = spans.map((span) => Math.max(...span) - Math.min(...span));
    const scale = Math.min((width - room - 60) / size[0], (height - 120) / size[1]);
    const middle = spans.map((span) => (Math.max(...span) + Math.min(...span)) / 2);
    const to2d = (p) => [(width - room + 60) / 2 + scale * (dot(p, right) - middle[0]), height / 2 + 10 - scale * (dot(p, up) - middle[1])];
    frame(pen, layout.scene, box, to2d, towards);
    const drawn = traces.flatMap((trace) => pieces(trace, to2d, towards)).sort((a, b) => a.depth - b.depth);
    for (const piece of drawn) paint(pen, piece);
    if (layout.showlegend) legend(pen, traces, layout.font.color, width);
    colourBar(pen, traces, layout.font.color, width, height);
  };
})();
