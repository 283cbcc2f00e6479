// The route on the map and the profiles under it, as SVG.

import { clear, drawToWidth, roomFor, ticks, widthOf } from "./axes.js";
import { GIVEN_BACK, powerColour, powerRange } from "./colours.js";
import { digitsFor, number, rounded } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";

export function svg(name, attributes, parent) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

// Mean power since the pose before, from the energy that the poses carry. It is a difference of
// sums: what three digits of the largest do not show counts as their rounding, and is zero.
export function wattsOf(poses) {
  const watts = poses.slice(1).map((pose, k) => {
    const time = pose.t - poses[k].t;
    return time > 0 ? (pose.energy_j - poses[k].energy_j) / time : 0;
  });
  const digits = digitsFor(watts, 3);
  return watts.map((value) => rounded(value, digits));
}

export function drawMarkers(overlay, frame, places) {
  overlay.setAttribute("viewBox", `0 0 ${frame.width} ${frame.height}`);
  overlay.querySelector("#markers")?.remove();
  const group = svg("g", { id: "markers" }, overlay);
  for (const [what, place] of Object.entries(places)) {
    if (!place) continue;
    const [cx, cy] = frame.toPixel(place.x, place.y);
    const marker = svg("circle", { cx, cy, r: 9, fill: what === "start" ? "#15803d" : "#b91c1c", stroke: "#fff", "stroke-width": 3 }, group);
    svg("title", {}, marker).textContent = what;
  }
}

export function drawRoute(overlay, frame, route) {
  overlay.querySelector("#route")?.remove();
  if (!route) return;
  const group = svg("g", { id: "route", fill: "none", "stroke-linecap": "round", "stroke-linejoin": "round" });
  overlay.prepend(group);
  const points = route.poses.map((pose) => frame.toPixel(pose.x, pose.y).map((v) => v.toFixed(1)).join(","));
  svg("polyline", { points: points.join(" "), stroke: "#fff", "stroke-width": 11 }, group);
  const watts = wattsOf(route.poses);
  const [low, high] = powerRange(watts);
  watts.forEach((value, k) => {
    svg("polyline", { points: `${points[k]} ${points[k + 1]}`, stroke: powerColour(value, low, high), "stroke-width": 6.5 }, group);
  });
}

export function drawLegend(legend, route) {
  const watts = wattsOf(route.poses);
  const [low, high] = powerRange(watts);
  const scale = svg("svg", { width: 140, height: 12, viewBox: "0 0 140 12", "aria-hidden": "true" });
  for (let k = 0; k < 35; k++) {
    svg("rect", { x: 4 * k, y: 0, width: 4.2, height: 12, fill: powerColour(low + (k / 34) * (high - low), low, high) }, scale);
  }
  const said = (value) => Object.assign(document.createElement("span"), { textContent: `${number(value, 3)} W` });
  legend.replaceChildren(said(low), scale, said(high));
  if (watts.some((value) => value < 0)) {
    const back = svg("svg", { width: 12, height: 12, "aria-hidden": "true" });
    svg("rect", { width: 12, height: 12, fill: GIVEN_BACK }, back);
    legend.append(back, "gives back");
  }
  legend.hidden = false;
}

export function drawProfile(chart, route) {
  const along = [0];
  route.poses.slice(1).forEach((pose, k) => {
    const before = route.poses[k];
    along.push(along[k] + Math.hypot(pose.x - before.x, pose.y - before.y, pose.z - before.z));
  });
  const heights = route.poses.map((pose) => pose.z);
  const watts = wattsOf(route.poses);
  drawToWidth(chart, (width) => {
    chart.setAttribute("viewBox", `0 0 ${width} 232`);
    chart.replaceChildren();
    const panels = [
      profilePanel(heights, 16, 92, "height (m)", "#7a5a2f"),
      profilePanel([...watts, 0], 122, 208, "power (W)", "#b91c5c"),
    ];
    const length = along.at(-1) || 1;
    const distances = ticks(0, length).map(({ value, words }) => ({ value, words: `${words} m` }));
    const left = Math.max(...panels.map(({ numbers }) => roomFor(numbers)));
    const right = width - Math.max(...distances.map(({ words }) => widthOf(words))) / 2 - 2;
    const x = (distance) => left + (distance / length) * (right - left);
    for (const panel of panels) drawPanel(chart, panel, left, right);
    for (const [values, panel] of [[heights, panels[0]], [watts, panels[1]]]) {
      const offset = along.length - values.length;
      const points = values.map((value, k) => `${x(along[k + offset]).toFixed(1)},${panel.y(value).toFixed(1)}`);
      svg("polyline", { points: points.join(" "), fill: "none", stroke: panel.colour, "stroke-width": 1.6 }, chart);
    }
    for (const { value, words } of clear(distances, x)) {
      svg("text", { x: x(value), y: 226, "text-anchor": "middle", fill: "#5b6472" }, chart).textContent = words;
    }
  });
}

function profilePanel(values, top, bottom, unit, colour) {
  const [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  // Flat ground shall look flat, not like a mountain of rounding errors.
  const span = Math.max(high - low, 0.1);
  return { top, unit, colour, numbers: ticks(low, low + span), y: (value) => bottom - ((value - low) / span) * (bottom - top) };
}

function drawPanel(chart, { top, unit, numbers, y }, left, right) {
  for (const { value, words } of numbers) {
    svg("line", { x1: left, x2: right, y1: y(value), y2: y(value), stroke: "#e2e4e8" }, chart);
    svg("text", { x: left - 4, y: y(value) + 3, "text-anchor": "end", fill: "#5b6472" }, chart).textContent = words;
  }
  svg("text", { x: left, y: top - 6, fill: "#5b6472" }, chart).textContent = unit;
}
