"use strict";
// One cursor for the map and the charts of a section: the pose nearest to the pointer.

const SVG = "http://www.w3.org/2000/svg";

function element(parent, name, className) {
  const made = document.createElementNS(SVG, name);
  made.setAttribute("class", className);
  made.setAttribute("visibility", "hidden");
  return parent.appendChild(made);
}

function place(svg, event) {
  return new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
}

function nearest(values, wanted) {
  let low = 0;
  let high = values.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (values[middle] < wanted) low = middle; else high = middle;
  }
  return wanted - values[low] < values[high] - wanted ? low : high;
}

function linkCursor(section) {
  const holder = section.querySelector("script.poses");
  if (!holder) return;
  const poses = JSON.parse(holder.textContent);
  const readout = section.querySelector(".readout");
  const map = section.querySelector("svg.map");
  const here = element(map, "circle", "here");
  here.setAttribute("r", 6);
  const charts = [...section.querySelectorAll("svg.chart[data-range]")].map((svg) => {
    const [x0, x1] = svg.dataset.range.split(",").map(Number);
    const [left, top, right, bottom] = svg.dataset.inner.split(",").map(Number);
    const cursor = element(svg, "line", "cursor");
    cursor.setAttribute("y1", top);
    cursor.setAttribute("y2", bottom);
    return { svg, cursor, toPixel: (d) => left + (d - x0) / (x1 - x0) * (right - left), toDistance: (p) => x0 + (p - left) / (right - left) * (x1 - x0) };
  });
  const { x0, y1, scale } = map.dataset;

  function show(k) {
    const x = (poses.x[k] - x0) * scale;
    const y = (y1 - poses.y[k]) * scale;
    here.setAttribute("cx", x);
    here.setAttribute("cy", y);
    here.setAttribute("visibility", "visible");
    for (const chart of charts) {
      const p = chart.toPixel(poses.distance[k]);
      chart.cursor.setAttribute("x1", p);
      chart.cursor.setAttribute("x2", p);
      chart.cursor.setAttribute("visibility", "visible");
    }
    // What rounds to zero has no sign.
    const f = (value, digits) => (Number(value.toFixed(digits)) + 0).toFixed(digits);
    readout.textContent = `${f(poses.distance[k], 2)} m · ${f(poses.t[k], 1)} s · height ${f(poses.z[k], 2)} m · ` +
      `${f(poses.speed[k], 2)} m/s · ${f(poses.watts[k], 1)} W · ${f(poses.energy_j[k], 0)} J so far`;
  }

  for (const chart of charts) {
    chart.svg.addEventListener("pointermove", (event) => {
      show(nearest(poses.distance, chart.toDistance(place(chart.svg, event).x)));
    });
  }
  map.addEventListener("pointermove", (event) => {
    const at = place(map, event);
    let best = 0;
    let least = Infinity;
    for (let k = 0; k < poses.x.length; k++) {
      const away = Math.hypot((poses.x[k] - x0) * scale - at.x, (y1 - poses.y[k]) * scale - at.y);
      if (away < least) { least = away; best = k; }
    }
    show(best);
  });
}

document.querySelectorAll("section").forEach(linkCursor);
