// What the map says about its ground: its kinds, and where the chosen robot cannot go.

import { Turns, byId, fragment } from "./api.js";

const loading = new Turns();
let layer = null;

// Put the layer under the routes of the map that is shown.
export function drawGround() {
  const map = byId("picture").firstElementChild;
  if (layer && map && !map.contains(layer)) map.querySelector("image").after(layer);
}

export function forgetGround() {
  loading.abort();
  layer?.remove();
  layer = null;
  byId("ground").hidden = true;
}

// A vehicle or model that the service does not know is said when it is planned with.
export function loadGround(map, start) {
  forgetGround();
  const path = map.split("/").map(encodeURIComponent).join("/");
  const show = ({ report }) => {
    const drawn = fragment(report);
    layer = drawn.querySelector(".drivable");
    if (!layer) return;
    byId("ground-legend").replaceChildren(drawn.querySelector(".legend"));
    byId("ground").hidden = false;
    drawGround();
  };
  loading.load([`/v1/maps/${path}/ground?${new URLSearchParams(start)}`], show, () => {});
}

export function beginGround() {
  byId("show-ground").addEventListener("change", ({ target }) => byId("stage").classList.toggle("bare", !target.checked));
}
