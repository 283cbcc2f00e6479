// The route that is shown, as files of other programs.

import { byId, element } from "./api.js";

const KINDS = {
  json: ["JSON", "application/json"],
  geojson: ["GeoJSON", "application/geo+json"],
  csv: ["CSV", "text/csv"],
  "nav-path": ["nav_msgs/Path", "application/json"],
};
const ENDINGS = { "nav-path": "nav-path.json" };
let offered = [];

export function withdrawDownloads() {
  offered.forEach(URL.revokeObjectURL);
  offered = [];
  byId("downloads").replaceChildren();
}

// A link for each format. The service wrote them with the answer, so that each has this very route.
export function offerDownloads({ report, files, ...route }) {
  withdrawDownloads();
  const texts = { json: JSON.stringify(route), ...files };
  const links = Object.entries(texts).map(([name, text]) => {
    const [title, type] = KINDS[name];
    const href = URL.createObjectURL(new Blob([text], { type }));
    offered.push(href);
    return element("a", title, { href, download: `route.${ENDINGS[name] ?? name}` });
  });
  byId("downloads").replaceChildren("Download the route: ", ...links);
}
