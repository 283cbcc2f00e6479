// The workbench's pictures, as SVG: residuals over quantities, errors against the noise, shapes.

import { svg } from "./drawing.js";
import { watts } from "./words.js";

const SOFT = "#5b6472";
const LINE = "#e2e4e8";
const WRONG = "#b91c5c";
const GOOD = "#15803d";
const DEGREES = 180 / Math.PI;

// What quantities are called, and how their values are shown.
const QUANTITIES = {
  heading: ["heading (°, 90 is left)", DEGREES],
  speed: ["speed (m/s)", 1],
  yaw_rate: ["yaw rate (°/s)", DEGREES],
  slope_along: ["slope along the way (°)", DEGREES],
  slope_across: ["slope across (°)", DEGREES],
  load: ["load (kg)", 1],
  temperature: ["temperature (°C)", 1],
  acceleration: ["acceleration (m/s²)", 1],
  time_since_start: ["time since start (s)", 1],
};
const called = (quantity) => QUANTITIES[quantity] ?? [quantity.replaceAll("_", " "), 1];

const short = (value) => String(Number(value.toPrecision(2)));

// Words keep clear of lines that cross them.
function text(parent, x, y, words, attributes = {}) {
  const halo = { stroke: "#fff", "stroke-width": 3, "paint-order": "stroke" };
  svg("text", { x, y, fill: SOFT, ...halo, ...attributes }, parent).textContent = words;
}

// One chart: axes with few numbers, and functions from values to places.
function panel(chart, place, xs, ys, heading, ends = true) {
  const { left, top, width, height } = place;
  const [x0, x1] = [Math.min(...xs), Math.max(...xs)];
  const [y0, y1] = [Math.min(0, ...ys), Math.max(0, ...ys)];
  const x = (value) => left + ((value - x0) / (x1 - x0 || 1)) * width;
  const y = (value) => top + height - ((value - y0) / (y1 - y0 || 1)) * height;
  for (const value of new Set([y0, 0, y1])) {
    svg("line", { x1: left, x2: left + width, y1: y(value), y2: y(value), stroke: value === 0 ? "#9aa1ab" : LINE }, chart);
    text(chart, left - 4, y(value) + 3, short(value), { "text-anchor": "end" });
  }
  for (const [value, anchor] of ends ? [[x0, "start"], [x1, "end"]] : []) text(chart, x(value), top + height + 12, short(value), { "text-anchor": anchor });
  text(chart, left + width / 2, top + height + 12, heading, { "text-anchor": "middle" });
  return { x, y };
}

const points = (places) => places.map(([a, b]) => `${a.toFixed(1)},${b.toFixed(1)}`).join(" ");

// How much of a curve is more than its own uncertainty: what to show first.
function structure({ bias_w: bias, stderr_w: stderr, rows }) {
  return bias.reduce((sum, value, k) => sum + (rows[k] ?? 1) * Math.max(0, value * value - (stderr[k] ?? 0) ** 2), 0);
}

// Mean of measured minus predicted over each quantity, with its 95 % band; most telling first.
export function drawCurves(chart, curves, noise) {
  chart.replaceChildren();
  const drawn = Object.entries(curves).filter(([, { x }]) => x.length > 1).sort(([, a], [, b]) => structure(b) - structure(a)).slice(0, 6);
  const [columns, wide, high] = [2, 230, 112];
  chart.setAttribute("viewBox", `0 0 ${columns * wide} ${14 + Math.ceil(drawn.length / columns) * high}`);
  if (drawn.length) text(chart, 0, 10, `measured − predicted (W); the log's noise is ${watts(noise)} rms`);
  // A wide band of a few rows must not make everything else flat.
  const most = 1.3 * Math.max(...drawn.flatMap(([, { bias_w: bias }]) => bias.map(Math.abs)), noise);
  const clipped = (value) => Math.min(Math.max(value, -most), most);
  drawn.forEach(([quantity, curve], k) => {
    const [heading, scale] = called(quantity);
    const labelled = typeof curve.x[0] === "string";
    const xs = labelled ? curve.x.map((_, place) => place) : curve.x.map((value) => value * scale);
    const place = { left: (k % columns) * wide + 28, top: 24 + Math.floor(k / columns) * high, width: wide - 42, height: 68 };
    const group = svg("g", { role: "img", "aria-label": `Residual over ${heading}` }, chart);
    const { x, y } = panel(group, place, xs, [-most, most], labelled ? curve.x.join(", ") : heading, !labelled);
    const edge = (sign) => xs.map((value, n) => [x(value), y(clipped(curve.bias_w[n] + sign * 1.96 * (curve.stderr_w[n] ?? 0)))]);
    const middle = xs.map((value, n) => [x(value), y(curve.bias_w[n])]);
    if (labelled) {
      edge(1).forEach(([a, b], n) => svg("line", { x1: a, x2: a, y1: b, y2: edge(-1)[n][1], stroke: WRONG, "stroke-width": 4, opacity: 0.3 }, group));
      for (const [cx, cy] of middle) svg("circle", { cx, cy, r: 2.5, fill: WRONG }, group);
    } else {
      svg("polygon", { points: points([...edge(1), ...edge(-1).reverse()]), fill: WRONG, opacity: 0.16 }, group);
      svg("polyline", { points: points(middle), fill: "none", stroke: WRONG, "stroke-width": 1.6 }, group);
    }
  });
}

// Held-out errors as bars, the noise as the line that no model goes below.
export function drawErrors(chart, errors, noise) {
  chart.replaceChildren();
  chart.setAttribute("viewBox", `0 0 400 ${18 + 26 * errors.length}`);
  const most = Math.max(...errors.map(([, value]) => value), noise) * 1.02;
  const x = (value) => (value / most) * 300;
  errors.forEach(([, value], k) => {
    svg("rect", { x: 0, y: 13 + 26 * k, width: x(value), height: 11, rx: 2, fill: k === 0 ? WRONG : GOOD }, chart);
  });
  svg("line", { x1: x(noise), x2: x(noise), y1: 10, y2: 10 + 26 * errors.length, stroke: "#1f2937", "stroke-dasharray": "3 3" }, chart);
  errors.forEach(([name, value], k) => {
    text(chart, 0, 8.5 + 26 * k, name);
    text(chart, x(value) + 5, 22 + 26 * k, watts(value));
  });
  text(chart, x(noise), 16 + 26 * errors.length, `the log's own noise ${watts(noise)}`, { "text-anchor": x(noise) > 150 ? "end" : "start" });
}

export function drawShape(chart, quantity, shape) {
  chart.replaceChildren();
  chart.setAttribute("viewBox", "0 0 400 130");
  const [heading, scale] = called(quantity);
  const xs = shape.map(([value]) => value * scale);
  const ys = shape.map(([, value]) => value);
  const { x, y } = panel(chart, { left: 34, top: 8, width: 350, height: 100 }, xs, ys, heading);
  svg("polyline", { points: points(xs.map((value, k) => [x(value), y(ys[k])])), fill: "none", stroke: WRONG, "stroke-width": 1.8 }, chart);
}

// Held-out error version by version, falling towards the noise.
export function drawVersions(chart, entries) {
  chart.replaceChildren();
  const known = entries.filter(({ after }) => after?.heldout_rmse_w !== undefined && after.heldout_rmse_w !== null);
  chart.toggleAttribute("hidden", !known.length);
  if (!known.length) return;
  const [width, height, left, top] = [330, 96, 40, 30];
  chart.setAttribute("viewBox", "0 0 400 148");
  const errors = known.map(({ after }) => after.heldout_rmse_w);
  const noise = known.map((entry) => entry.noise_floor_w ?? null);
  const most = Math.max(...errors, ...noise.map((value) => value ?? 0)) * 1.1;
  const x = (k) => left + (known.length > 1 ? (k / (known.length - 1)) * width : width / 2);
  const y = (value) => top + height - (value / most) * height;
  for (const value of [0, most / 2, most]) {
    svg("line", { x1: left, x2: left + width, y1: y(value), y2: y(value), stroke: LINE }, chart);
    text(chart, left - 6, y(value) + 3, short(value), { "text-anchor": "end" });
  }
  const floor = noise.map((value, k) => (value === null ? null : [x(k), y(value)])).filter(Boolean);
  if (floor.length === 1) floor.push([floor[0][0] + 20, floor[0][1]]);
  svg("polyline", { points: points(floor), fill: "none", stroke: "#1f2937", "stroke-dasharray": "3 3" }, chart);
  svg("polyline", { points: points(errors.map((value, k) => [x(k), y(value)])), fill: "none", stroke: GOOD, "stroke-width": 2 }, chart);
  known.forEach(({ version }, k) => {
    svg("circle", { cx: x(k), cy: y(errors[k]), r: 3.5, fill: k === 0 ? WRONG : GOOD }, chart);
    text(chart, x(k), y(errors[k]) - 7, watts(errors[k]), { "text-anchor": k === 0 ? "start" : "end" });
    text(chart, x(k), top + height + 14, `v${version}`, { "text-anchor": "middle" });
  });
  text(chart, left, 8, "held-out error (W); dashed: the logs' own noise");
}
