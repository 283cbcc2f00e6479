"use strict";
// One cursor for the map and the charts of a section: the pose nearest to the pointer.

const SVG = "http://www.w3.org/2000/svg";

function set(node, attributes) {
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
}

function add(parent, name, attributes) {
  const made = parent.appendChild(document.createElementNS(SVG, name));
  set(made, { visibility: "hidden", ...attributes });
  return made;
}

function place(svg, event) {
  return new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
}

// What rounds to zero has no sign.
function fixed(value, digits) {
  return (Number(value.toFixed(digits)) + 0).toFixed(digits);
}

function linkCursor(section) {
  const holder = section.querySelector("script.poses");
  if (!holder) return;
  const poses = JSON.parse(holder.textContent);
  const readout = section.querySelector(".readout");
  const map = section.querySelector("svg.map");
  const here = add(map, "circle", { class: "here", r: 6 });
  const { x0, y1, scale } = map.dataset;
  const x = (k) => (poses.x[k] - x0) * scale;
  const y = (k) => (y1 - poses.y[k]) * scale;
  const charts = [...section.querySelectorAll("svg.chart[data-range]")].map((svg) => {
    const [d0, d1] = svg.dataset.range.split(",").map(Number);
    const [left, top, right, bottom] = svg.dataset.inner.split(",").map(Number);
    const cursor = add(svg, "line", { class: "cursor", y1: top, y2: bottom });
    const toPixel = (d) => left + (d - d0) / (d1 - d0) * (right - left);
    return { svg, cursor, toPixel };
  });

  function show(k) {
    set(here, { cx: x(k), cy: y(k), visibility: "visible" });
    for (const { cursor, toPixel } of charts) {
      const p = toPixel(poses.distance[k]);
      set(cursor, { x1: p, x2: p, visibility: "visible" });
    }
    const f = (name, digits) => fixed(poses[name][k], digits);
    readout.textContent = `${f("distance", 2)} m · ${f("t", 1)} s · height ${f("z", 2)} m · ` +
      `${f("speed", 2)} m/s · ${f("watts", 1)} W · ${f("energy_j", 0)} J so far`;
  }

  // Shows the pose that is least away from the pointer over a drawing, in its pixels.
  function follow(svg, away) {
    svg.addEventListener("pointermove", (event) => {
      const at = place(svg, event);
      const all = poses.x.map((_, k) => away(k, at));
      show(all.indexOf(Math.min(...all)));
    });
  }

  follow(map, (k, at) => Math.hypot(x(k) - at.x, y(k) - at.y));
  for (const { svg, toPixel } of charts) {
    follow(svg, (k, at) => Math.abs(toPixel(poses.distance[k]) - at.x));
  }
}

document.querySelectorAll("section").forEach(linkCursor);
