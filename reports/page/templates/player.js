"use strict";
// Plays motions of rigid units on canvases; the data is described in reports/panels/animation_data.py.
(() => {
  const root = document.getElementById("player");
  const data = JSON.parse(document.getElementById("player-data").textContent);

  const decode = (text, Type) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Type(bytes.buffer);
  };

  const axis = { ...data.axis, values: decode(data.axis.values, Float32Array) };
  const structures = data.structures.map((item) => ({
    ...item,
    centroid: decode(item.centroid, Float32Array),
    arm: decode(item.arm, Float32Array),
    owner: decode(item.owner, Int32Array),
    ligaments: decode(item.ligaments, Int32Array),
  }));
  const unpacked = (structures) => structures.map((cases) => cases.map((item) =>
    item && { step: item.step, data: decode(item.data, Int16Array) }));
  const motion = unpacked(data.motion);
  const residual = unpacked(data.residual);
  const maps = Object.fromEntries(
    Object.entries(data.maps).map(([name, text]) => [name, decode(text, Uint8Array)]));

  const NO_DATA = -32768;
  const first = axis.values[0];
  const last = axis.values[axis.values.length - 1];
  const state = { at: first, playing: false, load: data.start, field: 0, residual: false,
    rate: data.speeds[0].rate };

  const make = (tag, properties = {}, parent = null) => {
    const node = Object.assign(document.createElement(tag), properties);
    if (parent) parent.append(node);
    return node;
  };

  // --- the numbers -------------------------------------------------------------------------

  const bracket = (at) => {
    let low = 0;
    let high = axis.values.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (axis.values[middle] <= at) low = middle; else high = middle;
    }
    const width = axis.values[high] - axis.values[low];
    return { low, high, part: width > 0 ? Math.min(1, Math.max(0, (at - axis.values[low]) / width)) : 0 };
  };

  const sampled = ({ step, data: levels }, index, at) => {
    const count = structures[index].centroid.length / 2;
    const { low, high, part } = bracket(at);
    const out = new Float32Array(3 * count);
    for (let k = 0; k < 3 * count; k += 1) {
      const a = levels[low * 3 * count + k];
      const b = levels[high * 3 * count + k];
      out[k] = a === NO_DATA || b === NO_DATA ? NaN : step[k % 3] * (a + (b - a) * part);
    }
    return out;
  };

  const scalar = (field, u, unit) => {
    const [x, y, turn] = [u[3 * unit], u[3 * unit + 1], u[3 * unit + 2]];
    const { key, factor, scale } = field;
    if (key === "norm") return factor * Math.hypot(x / scale[0], y / scale[1], turn / scale[2]);
    return factor * { ux: x, uy: y, theta: turn, turn: Math.abs(turn) }[key];
  };

  const limits = (field) => (state.residual ? field.residual : field.limits);

  const colour = (field, value) => {
    if (Number.isNaN(value)) return "#ffffff";
    const [low, high] = limits(field);
    const level = Math.round(255 * Math.min(1, Math.max(0, (value - low) / (high - low))));
    const map = maps[field.map];
    return `rgb(${map[3 * level]},${map[3 * level + 1]},${map[3 * level + 2]})`;
  };

  // --- the page ----------------------------------------------------------------------------

  const box = structures.reduce((found, { centroid, arm, owner, pads }) => {
    const corners = pads.flat(2);
    for (let v = 0; v < owner.length; v += 1) {
      corners.push([centroid[2 * owner[v]] + arm[2 * v], centroid[2 * owner[v] + 1] + arm[2 * v + 1]]);
    }
    for (const [x, y] of corners) {
      found.left = Math.min(found.left, x);
      found.right = Math.max(found.right, x);
      found.low = Math.min(found.low, y);
      found.high = Math.max(found.high, y);
    }
    return found;
  }, { left: Infinity, right: -Infinity, low: Infinity, high: -Infinity });
  const margin = 0.035 * Math.max(box.right - box.left, box.high - box.low);
  const extent = { x: box.left - margin, y: box.high + margin,
    width: box.right - box.left + 2 * margin, height: box.high - box.low + 2 * margin };

  const stage = make("div", { className: "stage" }, root);
  const figures = [];
  const canvases = structures.map((structure) => {
    const figure = make("figure", {}, stage);
    make("figcaption", { textContent: structure.name, style: `color:${structure.colour}` }, figure);
    const canvas = make("canvas", {}, figure);
    canvas.setAttribute("role", "img");
    canvas.style.aspectRatio = `${extent.width} / ${extent.height}`;
    figures.push(figure);
    return canvas;
  });
  const bar = make("div", { className: "bar" }, root);
  const barLabel = make("span", { className: "bar-label" }, bar);
  const barLow = make("span", {}, bar);
  const barCanvas = make("canvas", { width: 256, height: 1 }, bar);
  barCanvas.setAttribute("aria-hidden", "true");
  const barHigh = make("span", {}, bar);

  const transport = make("div", { className: "transport" }, root);
  const button = make("button", { type: "button", className: "play" }, transport);
  const slider = make("input", { type: "range", min: 0, max: 10000, step: 1, value: 0 }, transport);
  slider.setAttribute("aria-label", axis.name);
  const readout = make("output", {}, transport);

  const choices = make("div", { className: "choices" }, root);
  const menu = (label, options, chosen, change) => {
    const wrapper = make("label", { textContent: `${label} ` }, choices);
    const select = make("select", {}, wrapper);
    options.forEach((text, index) => make("option", { value: index, textContent: text }, select));
    select.value = chosen;
    select.addEventListener("change", () => { change(Number(select.value)); paint(); });
    return select;
  };
  if (data.cases.length > 1) {
    menu("Load", data.cases, state.load, (index) => { state.load = index; }).id = "player-case";
  }
  const named = { u_x: "displacement along x", u_y: "displacement along y" }; // no index in a menu
  menu("Colour", data.fields.map((field) => named[field.label] || field.label), 0,
    (index) => { state.field = index; paintBar(); }).id = "player-field";
  if (residual.some((cases) => cases.some(Boolean))) {
    menu("View", ["motion", "residual: measured less simulated"], 0,
      (index) => { state.residual = index === 1; paintBar(); }).id = "player-view";
  }
  menu("Speed", data.speeds.map((speed) => speed.label), 0,
    (index) => { state.rate = data.speeds[index].rate; }).id = "player-speed";
  make("p", { className: "hint", textContent: "Space plays and pauses, ← and → step, Home and End jump. "
    + "Displacements at true size." }, root);

  // --- drawing -----------------------------------------------------------------------------

  const fit = (canvas) => {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    return canvas.width / extent.width;
  };

  const corners = (structure, u) => {
    const { centroid, arm, owner } = structure;
    const out = new Float32Array(arm.length);
    for (let v = 0; v < owner.length; v += 1) {
      const unit = owner[v];
      const known = !Number.isNaN(u[3 * unit]);
      const turn = known ? u[3 * unit + 2] : 0;
      const cosine = Math.cos(turn);
      const sine = Math.sin(turn);
      const [a, b] = [arm[2 * v], arm[2 * v + 1]];
      out[2 * v] = centroid[2 * unit] + (known ? u[3 * unit] : 0) + cosine * a - sine * b;
      out[2 * v + 1] = centroid[2 * unit + 1] + (known ? u[3 * unit + 1] : 0) + sine * a + cosine * b;
    }
    return out;
  };

  const drawClamps = (pen, structure) => {
    pen.strokeStyle = "#1a1a1a";
    pen.fillStyle = "#d4d7db";
    for (const pad of structure.pads) {
      pen.beginPath();
      for (const ring of pad) {
        ring.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
        pen.closePath();
      }
      pen.fill("evenodd");
      pen.stroke();
    }
  };

  const drawUnits = (pen, structure, points, shown) => {
    const field = data.fields[state.field];
    const { owner } = structure;
    for (let v = 0; v < owner.length;) {
      const unit = owner[v];
      pen.beginPath();
      for (; v < owner.length && owner[v] === unit; v += 1) pen.lineTo(points[2 * v], points[2 * v + 1]);
      pen.closePath();
      pen.fillStyle = shown ? colour(field, scalar(field, shown, unit)) : "#eceef0";
      pen.fill();
      pen.stroke();
    }
  };

  const drawMarks = (pen, structure, u, pixel) => {
    pen.setLineDash([6 * pixel, 4 * pixel]);
    pen.lineWidth = 1.6 * pixel;
    for (const circle of data.circles) {
      pen.beginPath();
      pen.strokeStyle = circle.colour;
      pen.arc(circle.x, circle.y, circle.radius, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.setLineDash([]);
    const unit = structure.marker;
    if (unit === null) return;
    pen.beginPath();
    pen.arc(structure.centroid[2 * unit] + (u[3 * unit] || 0),
      structure.centroid[2 * unit + 1] + (u[3 * unit + 1] || 0), 4.5 * pixel, 0, 2 * Math.PI);
    pen.fillStyle = structure.colour;
    pen.strokeStyle = "#ffffff";
    pen.fill();
    pen.stroke();
  };

  const draw = (canvas, index) => {
    const scale = fit(canvas);
    const pixel = (window.devicePixelRatio || 1) / scale;
    const structure = structures[index];
    const u = sampled(motion[index][state.load], index, state.at);
    const apart = residual[index][state.load];
    const shown = state.residual ? apart && sampled(apart, index, state.at) : u;
    const points = corners(structure, u);
    const pen = canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.setTransform(scale, 0, 0, -scale, -extent.x * scale, extent.y * scale);
    pen.lineJoin = "round";
    pen.lineWidth = 0.7 * pixel;
    drawClamps(pen, structure);
    pen.strokeStyle = "#6b6f75";
    pen.beginPath();
    for (let k = 0; k < structure.ligaments.length; k += 2) {
      const [a, b] = [structure.ligaments[k], structure.ligaments[k + 1]];
      pen.moveTo(points[2 * a], points[2 * a + 1]);
      pen.lineTo(points[2 * b], points[2 * b + 1]);
    }
    pen.stroke();
    pen.strokeStyle = "#1a1a1a";
    pen.lineWidth = 0.45 * pixel;
    drawUnits(pen, structure, points, shown);
    drawMarks(pen, structure, u, pixel);
  };

  const paintBar = () => {
    const field = data.fields[state.field];
    const unit = field.unit ? ` ${field.unit}` : "";
    const pen = barCanvas.getContext("2d");
    for (let k = 0; k < 256; k += 1) {
      const [low, high] = limits(field);
      pen.fillStyle = colour(field, low + (high - low) * (k / 255));
      pen.fillRect(k, 0, 1, 1);
    }
    const number = (value) => `${Number(value.toPrecision(3))}`.replace("-", "−");
    const [low, high] = limits(field);
    const [symbol, index] = field.label.split("_");
    barLabel.textContent = state.residual ? `residual ${symbol}` : symbol;
    if (index) make("sub", { textContent: index }, barLabel);
    barLow.textContent = number(low) + unit;
    barHigh.textContent = number(high) + unit;
  };

  const paint = () => {
    const words = `${axis.name} = ${state.at.toFixed(axis.digits)} ${axis.unit}`;
    canvases.forEach((canvas, index) => {
      figures[index].hidden = !motion[index][state.load];
      if (!figures[index].hidden) draw(canvas, index);
      canvas.setAttribute("aria-label",
        `${structures[index].name} structure, ${data.cases[state.load]}, ${words}`);
    });
    slider.value = Math.round((10000 * (state.at - first)) / (last - first || 1));
    slider.setAttribute("aria-valuetext", words);
    readout.textContent = words;
    root.dataset.at = state.at;
    root.dataset.playing = state.playing;
  };

  // --- running -----------------------------------------------------------------------------

  let previous = 0;
  const tick = (now) => {
    if (!state.playing) return;
    const passed = Math.min(0.1, (now - previous) / 1000);
    previous = now;
    state.at += state.rate * passed;
    if (state.at >= last) {
      if (axis.loops) state.at = first + ((state.at - first) % (last - first || 1));
      else { state.at = last; play(false); }
    }
    paint();
    window.requestAnimationFrame(tick);
  };

  const play = (on) => {
    if (on && state.at >= last) state.at = first;
    state.playing = on;
    button.textContent = on ? "Pause" : "Play";
    button.setAttribute("aria-pressed", on);
    root.dataset.playing = on;
    if (!on) return;
    previous = performance.now();
    window.requestAnimationFrame(tick);
  };

  const jump = (at) => {
    play(false);
    state.at = Math.min(last, Math.max(first, at));
    paint();
  };

  const stepBy = (count) => {
    const { low, part } = bracket(state.at);
    const here = part > 0.999 ? low + 1 : low;
    const next = count > 0 ? here + 1 : (part > 0.001 && part <= 0.999 ? low : here - 1);
    jump(axis.values[Math.min(axis.values.length - 1, Math.max(0, next))]);
  };

  button.addEventListener("click", () => play(!state.playing));
  slider.addEventListener("input", () => jump(first + ((last - first) * slider.value) / 10000));
  root.addEventListener("keydown", (event) => {
    const actions = {
      " ": () => play(!state.playing),
      ArrowLeft: () => stepBy(-1),
      ArrowRight: () => stepBy(1),
      Home: () => jump(first),
      End: () => jump(last),
    };
    const onMenu = event.target.tagName === "SELECT";
    const onButton = event.target.tagName === "BUTTON" && event.key === " ";
    if (onMenu || onButton || !(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  });

  new ResizeObserver(paint).observe(stage);
  play(false);
  paintBar();
  paint();
})();
