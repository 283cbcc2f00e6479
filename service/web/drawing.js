// The route on the map and the profiles under it, as SVG.

import { GIVEN_BACK, powerColour, powerRange } from "./colours.js";

const SVG = "http://www.w3.org/2000/svg";

export function svg(name, attributes, parent) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

// Mean power since the pose before, from the energy that the poses carry.
export function wattsOf(poses) {
  return poses.slice(1).map((pose, k) => {
    const time = pose.t - poses[k].t;
    return time > 0 ? (pose.energy_j - poses[k].energy_j) / time : 0;
  });
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
  legend.replaceChildren(`${low.toPrecision(3)} W`, scale, `${high.toPrecision(3)} W`);
  if (watts.some((value) => value < 0)) {
    const back = svg("svg", { width: 12, height: 12, "aria-hidden": "true" });
    svg("rect", { width: 12, height: 12, fill: GIVEN_BACK }, back);
    legend.append(back, "gives back");
  }
  legend.hidden = false;
}

export function drawProfile(chart, route) {
  const [width, left, right] = [380, 38, 374];
  chart.setAttribute("viewBox", `0 0 ${width} 232`);
  chart.replaceChildren();
  const along = [0];
  route.poses.slice(1).forEach((pose, k) => {
    const before = route.poses[k];
    along.push(along[k] + Math.hypot(pose.x - before.x, pose.y - before.y, pose.z - before.z));
  });
  const length = along.at(-1) || 1;
  const panel = (values, top, bottom, unit, colour, fromZero) => {
    const extremes = [Math.min(...values), Math.max(...values)];
    const low = fromZero ? Math.min(0, extremes[0]) : extremes[0];
    const span = Math.max(extremes[1] - low, 0.1);
    const y = (value) => bottom - ((value - low) / span) * (bottom - top);
    for (const value of [low, low + span / 2, low + span]) {
      svg("line", { x1: left, x2: right, y1: y(value), y2: y(value), stroke: "#e2e4e8" }, chart);
      svg("text", { x: left - 4, y: y(value) + 3, "text-anchor": "end", fill: "#5b6472" }, chart).textContent = Number(value.toPrecision(3));
    }
    svg("text", { x: left, y: top - 4, fill: "#5b6472" }, chart).textContent = unit;
    const offset = along.length - values.length;
    const points = values.map((value, k) => `${(left + (along[k + offset] / length) * (right - left)).toFixed(1)},${y(value).toFixed(1)}`);
    svg("polyline", { points: points.join(" "), fill: "none", stroke: colour, "stroke-width": 1.6 }, chart);
  };
  panel(route.poses.map((pose) => pose.z), 16, 92, "height (m)", "#7a5a2f", false);
  panel(wattsOf(route.poses), 122, 208, "power (W)", "#b91c5c", true);
  for (const share of [0, 0.5, 1]) {
    const anchor = share === 0 ? "start" : share === 1 ? "end" : "middle";
    svg("text", { x: left + share * (right - left), y: 226, "text-anchor": anchor, fill: "#5b6472" }, chart).textContent = `${Number((share * length).toPrecision(3))} m`;
  }
}
