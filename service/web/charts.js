// The workbench's pictures, as SVG: residuals over quantities, errors against the noise, shapes.

import { clear, drawToWidth, fitted, roomFor, ticks, widthOf } from "./axes.js";
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

// Words keep clear of lines that cross them.
function text(parent, x, y, words, attributes = {}) {
  const halo = { stroke: "#fff", "stroke-width": 3, "paint-order": "stroke" };
  svg("text", { x, y, fill: SOFT, ...halo, ...attributes }, parent).textContent = words;
}

// One chart: axes with few numbers, and functions from values to places. Names, if there are any,
// stand at their places instead of the numbers of the level axis.
function panel(chart, { left, top, width, height }, xs, ys, heading, names = null) {
  const [x0, x1] = names ? [-0.5, names.length - 0.5] : [Math.min(...xs), Math.max(...xs)];
  const [y0, y1] = [Math.min(0, ...ys), Math.max(0, ...ys)];
  const upright = ticks(y0, y1);
  const numbers = names ? [] : ticks(x0, x1, 2);
  const start = left + roomFor(upright);
  // The last number stands in the middle under its place.
  const inner = left + width - start - Math.max(0, ...numbers.map(({ words }) => widthOf(words))) / 2 - 2;
  const x = (value) => start + ((value - x0) / (x1 - x0 || 1)) * inner;
  const y = (value) => top + height - ((value - y0) / (y1 - y0 || 1)) * height;
  for (const { value, words } of upright) {
    svg("line", { x1: start, x2: start + inner, y1: y(value), y2: y(value), stroke: value === 0 ? "#9aa1ab" : LINE }, chart);
    text(chart, start - 4, y(value) + 3, words, { "text-anchor": "end" });
  }
  const below = { "text-anchor": "middle" };
  for (const { value, words } of clear(numbers, x)) text(chart, x(value), top + height + 13, words, below);
  names?.forEach((name, k) => text(chart, x(k), top + height + 13, fitted(name, inner / names.length - 4), below));
  text(chart, start + inner / 2, top + height + 27, fitted(heading, width), below);
  return { x, y };
}

const points = (places) => places.map(([a, b]) => `${a.toFixed(1)},${b.toFixed(1)}`).join(" ");

// How much of a curve is more than its own uncertainty: what to show first.
function structure({ bias_w: bias, stderr_w: stderr, rows }) {
  return bias.reduce((sum, value, k) => sum + (rows[k] ?? 1) * Math.max(0, value * value - (stderr[k] ?? 0) ** 2), 0);
}

// Mean of measured minus predicted over each quantity, with its 95 % band; most telling first.
export function drawCurves(chart, curves, noise) {
  const drawn = Object.entries(curves).filter(([, { x }]) => x.length > 1).sort(([, a], [, b]) => structure(b) - structure(a)).slice(0, 6);
  // A wide band of a few rows must not make everything else flat; nothing less than a milliwatt,
  // the last digit of power in words, is drawn large.
  const most = 1.3 * Math.max(...drawn.flatMap(([, { bias_w: bias }]) => bias.map(Math.abs)), noise, 1e-3);
  drawToWidth(chart, (width) => {
    chart.replaceChildren();
    const columns = width >= 460 ? 2 : 1;
    const [wide, high] = [width / columns, 140];
    chart.setAttribute("viewBox", `0 0 ${width} ${14 + Math.ceil(drawn.length / columns) * high}`);
    if (drawn.length) text(chart, 0, 10, fitted(`measured − predicted (W); the log's noise is ${watts(noise)} rms`, width));
    drawn.forEach(([quantity, curve], k) => {
      const place = { left: (k % columns) * wide, top: 26 + Math.floor(k / columns) * high, width: wide - 12, height: 84 };
      drawCurve(chart, place, quantity, curve, most);
    });
  });
}

function drawCurve(chart, place, quantity, curve, most) {
  const [heading, scale] = called(quantity);
  const names = typeof curve.x[0] === "string" ? curve.x : null;
  const xs = names ? names.map((_, k) => k) : curve.x.map((value) => value * scale);
  const group = svg("g", { role: "img", "aria-label": `Residual over ${heading}` }, chart);
  const { x, y } = panel(group, place, xs, [-most, most], heading, names);
  const clipped = (value) => Math.min(Math.max(value, -most), most);
  const edge = (sign) => xs.map((value, n) => [x(value), y(clipped(curve.bias_w[n] + sign * 1.96 * (curve.stderr_w[n] ?? 0)))]);
  const middle = xs.map((value, n) => [x(value), y(curve.bias_w[n])]);
  if (names) {
    edge(1).forEach(([a, b], n) => svg("line", { x1: a, x2: a, y1: b, y2: edge(-1)[n][1], stroke: WRONG, "stroke-width": 4, opacity: 0.3 }, group));
    for (const [cx, cy] of middle) svg("circle", { cx, cy, r: 2.5, fill: WRONG }, group);
  } else {
    svg("polygon", { points: points([...edge(1), ...edge(-1).reverse()]), fill: WRONG, opacity: 0.16 }, group);
    svg("polyline", { points: points(middle), fill: "none", stroke: WRONG, "stroke-width": 1.6 }, group);
  }
}

// Held-out errors as bars, the noise as the line that no model goes below.
export function drawErrors(chart, errors, noise) {
  const most = Math.max(...errors.map(([, value]) => value), noise) || 1;
  drawToWidth(chart, (width) => {
    chart.replaceChildren();
    chart.setAttribute("viewBox", `0 0 ${width} ${20 + 30 * errors.length}`);
    const room = Math.max(...errors.map(([, value]) => widthOf(watts(value)))) + 12;
    const x = (value) => (value / most) * (width - room);
    errors.forEach(([, value], k) => {
      svg("rect", { x: 0, y: 15 + 30 * k, width: x(value), height: 11, rx: 2, fill: k === 0 ? WRONG : GOOD }, chart);
    });
    svg("line", { x1: x(noise), x2: x(noise), y1: 12, y2: 10 + 30 * errors.length, stroke: "#1f2937", "stroke-dasharray": "3 3" }, chart);
    errors.forEach(([name, value], k) => {
      text(chart, 0, 10 + 30 * k, fitted(name, width));
      text(chart, x(value) + 5, 24.5 + 30 * k, watts(value));
    });
    text(chart, x(noise), 16 + 30 * errors.length, `the log's own noise ${watts(noise)}`, { "text-anchor": x(noise) > width / 2 ? "end" : "start" });
  });
}

export function drawShape(chart, quantity, shape) {
  const [heading, scale] = called(quantity);
  const xs = shape.map(([value]) => value * scale);
  const ys = shape.map(([, value]) => value);
  drawToWidth(chart, (width) => {
    chart.replaceChildren();
    chart.setAttribute("viewBox", `0 0 ${width} 142`);
    const { x, y } = panel(chart, { left: 0, top: 10, width, height: 100 }, xs, ys, heading);
    svg("polyline", { points: points(xs.map((value, k) => [x(value), y(ys[k])])), fill: "none", stroke: WRONG, "stroke-width": 1.8 }, chart);
  });
}

// Held-out error version by version, falling towards the noise.
export function drawVersions(chart, entries) {
  const known = entries.filter(({ after }) => after?.heldout_rmse_w !== undefined && after.heldout_rmse_w !== null);
  chart.toggleAttribute("hidden", !known.length);
  const errors = known.map(({ after }) => after.heldout_rmse_w);
  const noise = known.map((entry) => entry.noise_floor_w ?? null);
  const most = 1.1 * Math.max(...errors, ...noise.map((value) => value ?? 0)) || 1;
  if (known.length) drawToWidth(chart, (width) => drawFall(chart, width, known, errors, noise, most));
}

function drawFall(chart, width, known, errors, noise, most) {
  chart.replaceChildren();
  const [height, top] = [96, 30];
  const numbers = ticks(0, most);
  // Figures stand at their places: no more of them than there is room for.
  const widest = Math.max(...errors.map((value) => widthOf(watts(value)))) + 8;
  const left = roomFor(numbers);
  const [first, last] = [left + widest / 2, width - widest / 2];
  const every = Math.ceil((known.length * widest) / (last - first + widest));
  const x = (k) => (known.length > 1 ? first + (k / (known.length - 1)) * (last - first) : (first + last) / 2);
  const y = (value) => top + height - (value / most) * height;
  chart.setAttribute("viewBox", `0 0 ${width} 148`);
  for (const { value, words } of numbers) {
    svg("line", { x1: left, x2: width, y1: y(value), y2: y(value), stroke: LINE }, chart);
    text(chart, left - 4, y(value) + 3, words, { "text-anchor": "end" });
  }
  const floor = noise.map((value, k) => (value === null ? null : [x(k), y(value)])).filter(Boolean);
  if (floor.length === 1) floor.push([floor[0][0] + 20, floor[0][1]]);
  svg("polyline", { points: points(floor), fill: "none", stroke: "#1f2937", "stroke-dasharray": "3 3" }, chart);
  svg("polyline", { points: points(errors.map((value, k) => [x(k), y(value)])), fill: "none", stroke: GOOD, "stroke-width": 2 }, chart);
  known.forEach(({ version }, k) => {
    svg("circle", { cx: x(k), cy: y(errors[k]), r: 3.5, fill: k === 0 ? WRONG : GOOD }, chart);
    if ((known.length - 1 - k) % every) return;
    text(chart, x(k), y(errors[k]) - 7, watts(errors[k]), { "text-anchor": "middle" });
    text(chart, x(k), top + height + 14, `v${version}`, { "text-anchor": "middle" });
  });
  text(chart, 0, 9, fitted("held-out error (W); dashed: the logs' own noise", width));
}
