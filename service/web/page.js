// The page: planning above, the workbench below; a version that was adopted there plans here.

import { load } from "./api.js";
import { beginPlanning, complain, offerModels, planWith } from "./planning.js";
import { beginWorkbench } from "./workbench.js";

async function begin() {
  const paths = ["maps", "vehicles", "effects", "models", "logs"];
  const [maps, vehicles, effects, models, logs] = await Promise.all(paths.map((path) => load(`/v1/${path}`, complain)));
  beginWorkbench({ vehicles, effects, models, logs, planWith, modelsChanged: (now) => offerModels(vehicles, now) });
  beginPlanning(maps, vehicles, models);
}

begin().catch(complain);
