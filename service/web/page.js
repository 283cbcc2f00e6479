// The page: planning above, the workbench below; a version that was adopted there plans here.

import { byId, fetchJson } from "./api.js";
import { fillStarts } from "./choices.js";
import { beginPlanning, complain, planWith } from "./planning.js";
import { beginWorkbench } from "./workbench.js";

async function begin() {
  const paths = ["maps", "vehicles", "effects", "models", "logs"];
  const [maps, vehicles, effects, models, logs] = await Promise.all(paths.map((path) => fetchJson(`/v1/${path}`)));
  beginWorkbench({
    vehicles,
    effects,
    models,
    logs,
    planWith,
    modelsChanged: (now) => fillStarts(byId("vehicle"), vehicles, now),
  });
  await beginPlanning(maps, vehicles, models, effects);
}

begin().catch(complain);
