// The workbench: a measured log, where the model fails, what is missing, and versions that learn it.

import { byId, element, fetchJson, post, resultOf, row } from "./api.js";
import { chosen, fillStarts } from "./choices.js";
import { drawCurves, drawErrors, drawShape, drawVersions } from "./charts.js";
import { number, percent, signedWatts, watts } from "./words.js";

const state = { vehicles: [], models: [], titles: {}, job: null, planWith: null, modelsChanged: null };

function say(text, wrong = false) {
  const message = byId("work-message");
  message.textContent = text;
  message.classList.toggle("wrong", wrong);
  message.setAttribute("role", wrong ? "alert" : "status");
}

function busy(job) {
  state.job = job;
  byId("bench-choices").disabled = job !== null;
  byId("adopt").disabled = job !== null;
  byId("versions").querySelectorAll("button").forEach((button) => (button.disabled = job !== null));
  byId("work").hidden = job === null;
  byId("findings").setAttribute("aria-busy", String(job !== null));
  if (job === null) return;
  const { share, sentence } = job.progress ?? { share: 0, sentence: "" };
  if (share > 0) byId("work-progress").value = share;
  else byId("work-progress").removeAttribute("value");
  if (sentence) say(`${sentence[0].toUpperCase()}${sentence.slice(1)} …`);
}

// Carry out something that may be a job; buttons rest meanwhile.
async function work(first, begin, show) {
  busy({});
  say(first);
  try {
    const answer = await begin();
    await show(answer.state ? await resultOf(answer, busy) : answer);
  } catch (error) {
    say(error.message, true);
  } finally {
    busy(null);
  }
}

function fillLogs(logs, wanted) {
  const options = logs.map(({ id, name, rows, runs }) => new Option(`${name}: ${rows.toLocaleString("en")} rows, ${runs} runs`, id));
  byId("log").replaceChildren(...options);
  byId("log").disabled = !logs.length;
  for (const id of ["compare", "diagnose"]) byId(id).disabled = !logs.length;
  if (wanted) byId("log").value = wanted;
}

function upload(event) {
  event.preventDefault();
  const file = byId("log-file").files[0];
  if (!file) {
    say("Choose a log file first.", true);
    return;
  }
  const form = new FormData();
  form.append("log", file);
  const mapping = byId("mapping-file").files[0];
  if (mapping) form.append("mapping", mapping);
  work(`Sending ${file.name} …`, () => fetchJson("/v1/logs?wait=0", { method: "POST", body: form }), async (log) => {
    fillLogs(await fetchJson("/v1/logs"), log.id);
    showLog(log);
    byId("upload-form").reset();
    clearFindings();
    say(`${log.name} was read: ${log.rows.toLocaleString("en")} rows in ${log.runs} runs.`);
  });
}

function showLog(log) {
  const notes = [...log.report.map(({ sentence }) => sentence), ...log.derived.map((s) => `Derived: ${s}`), ...log.assumed.map((s) => `Assumed: ${s}`)];
  byId("log-notes").replaceChildren(...notes.map((note) => element("li", note)));
  byId("log-remarks").hidden = !notes.length;
}

async function logChosen() {
  clearFindings();
  showLog(await fetchJson(`/v1/logs/${byId("log").value}`));
}

function clearFindings() {
  byId("comparison-card").hidden = true;
  byId("diagnosis-card").hidden = true;
}

const asked = () => ({ log: byId("log").value, ...chosen(byId("start-model")) });

function compare() {
  work("Comparing …", () => post("/v1/compare", asked()), (found) => {
    showComparison(found);
    say("Compared.");
  });
}

function showRegimes(table, regimes) {
  const body = table.tBodies[0];
  body.replaceChildren();
  for (const { where, rows, bias_w: bias, rmse_w: rms, share_of_squared_error: share } of regimes) {
    row(body, [where, rows.toLocaleString("en"), signedWatts(bias), watts(rms), percent(share)]);
  }
  table.hidden = !regimes.length;
}

function showComparison(found) {
  byId("comparison-card").hidden = false;
  const heldout = found.fitted ? `, ${watts(found.heldout_rmse_w)} on runs that it was not fitted to` : "";
  const { measured_j: measured, predicted_j: predicted } = found.energy;
  const off = measured ? 100 * (predicted / measured - 1) : 0;
  byId("comparison-sentence").textContent =
    `${found.model.name} v${found.model.version} misses the measured power by ${watts(found.rmse_w)} rms${heldout}; ` +
    `the log's own noise is about ${watts(found.noise_floor_w)}. Energy: ${Math.abs(off).toFixed(1)} % too ${off < 0 ? "low" : "high"}.`;
  showRegimes(byId("regimes"), found.regimes);
  drawCurves(byId("curves"), found.pictures.curves, found.noise_floor_w);
}

function diagnose() {
  work("Diagnosing …", () => post("/v1/diagnose", asked()), (found) => {
    showDiagnosis(found);
    say("Diagnosed.");
  });
}

const title = (slug) => state.titles[slug] ?? slug;

function showDiagnosis(found) {
  byId("diagnosis-card").hidden = false;
  byId("verdict").textContent = found.sentence;
  const outside = found.outside_catalogue;
  const proposed = [...found.selected, ...(outside?.name ? [outside.name] : [])];
  const errors = [["model as it is", found.baseline.heldout_rmse_w]];
  if (proposed.length) errors.push([`with ${proposed.map(title).join(" + ")}`, found.after.heldout_rmse_w]);
  drawErrors(byId("errors"), errors, found.baseline.noise_floor_w);
  showRanking(found, proposed);
  byId("outside").hidden = !outside;
  if (outside) {
    byId("formula").textContent = outside.formula ? `${outside.name} = ${outside.formula}` : "";
    drawShape(byId("shape"), outside.quantities[0], outside.shape);
  }
  const remarks = [
    ...(found.sensor ?? []).map(({ sentence }) => sentence),
    ...found.experiments.map(({ separates, run }) => `To separate ${separates.map(title).join(" and ")}: ${run}`),
  ];
  byId("diagnosis-remarks").replaceChildren(...remarks.map((remark) => element("li", remark)));
  const untold = (found.not_testable ?? []).map(({ effect, why, what_would_help: help }) => `${title(effect)}: ${why}${help ? `; ${help}` : ""}`);
  byId("untestable").replaceChildren(...untold.map((line) => element("li", line)));
  byId("untestable-part").hidden = !untold.length;
}

function showRanking(found, proposed) {
  const body = byId("ranking").tBodies[0];
  body.replaceChildren();
  const testable = found.candidates.filter(({ testable }) => testable !== false);
  for (const candidate of testable.slice(0, 6)) {
    const bar = element("meter", "", { min: 0, max: 1, value: candidate.probability, "aria-hidden": "true" });
    const values = Object.entries(candidate.parameters).map(([name, { value, stderr, unit }]) =>
      `${name} ${number(value, 3)}${stderr === null ? "" : ` ± ${number(stderr, 2)}`} ${unit === "1" ? "" : unit}`.trim());
    const same = candidate.indistinguishable_from.map(title).join(", ");
    const name = element("span", title(candidate.effect));
    name.append(element("small", [`${candidate.effect}: ${values.join(", ")}`, same && `cannot be told from ${same}`].filter(Boolean).join("; ")));
    const line = row(body, [name, bar, percent(candidate.probability), watts(candidate.heldout_rmse_w)]);
    line.classList.toggle("selected", proposed.includes(candidate.effect));
  }
  byId("ranking").hidden = !testable.length;
  const others = testable.filter(({ effect }) => !proposed.includes(effect));
  const options = others.map(({ effect }) => new Option(title(effect), effect));
  if (proposed.length) options.unshift(new Option(proposed.map(title).join(" + "), "diagnosed"));
  byId("adopt-what").replaceChildren(...options);
  byId("adoption").hidden = !options.length;
}

function adopt() {
  work("Adopting …", () => post("/v1/adopt", { ...asked(), effects: [byId("adopt-what").value] }), async (found) => {
    clearFindings();
    await modelAdded(found.model_id);
    const warnings = [...new Set(found.warnings)].map((warning) => ` Warning: ${warning}.`).join("");
    say(`Adopted ${found.adopted.map(title).join(" + ")}: held-out error ${watts(found.before.heldout_rmse_w)} → ` +
      `${watts(found.after.heldout_rmse_w)}, noise ${watts(found.noise_floor_w)}.${warnings}`);
  });
}

async function modelAdded(id) {
  state.models = await fetchJson("/v1/models");
  state.modelsChanged(state.models);
  fillStarts(byId("start-model"), state.vehicles, state.models, id);
  await showVersions();
}

async function showVersions() {
  const { model } = chosen(byId("start-model"));
  byId("versions-card").hidden = !model;
  if (!model) return;
  const entries = await fetchJson(`/v1/models/${model}/history`);
  drawVersions(byId("fall"), entries);
  const body = byId("versions").tBodies[0];
  body.replaceChildren();
  for (const entry of entries) {
    const what = entry.action === "adopt" ? entry.adopted.map(title).join(" + ") : entry.action === "fit" ? "base model" : `back to version ${entry.reverted_to ?? "?"}`;
    const buttons = element("span", "", { class: "buttons" });
    if (entry.id) {
      const plan = element("button", "Plan with it", { type: "button" });
      plan.addEventListener("click", () => state.planWith(entry.id));
      const file = element("a", "File", { href: `/v1/models/${entry.id}`, download: `model-v${entry.version}.json` });
      buttons.append(plan, file);
    }
    if (entry !== entries.at(-1)) {
      const back = element("button", "Back to it", { type: "button", class: "plain" });
      back.addEventListener("click", () => revert(model, entry.version));
      buttons.append(back);
    }
    row(body, [`v${entry.version}`, what, entry.log?.source ?? "", watts(entry.after?.heldout_rmse_w), buttons]);
  }
}

function revert(model, version) {
  work("Going back …", () => post(`/v1/models/${model}/revert`, { version }), async (made) => {
    await modelAdded(made.id);
    say(`Version ${made.version} is as version ${version} was.`);
  });
}

export function beginWorkbench({ vehicles, effects, models, logs, planWith, modelsChanged }) {
  Object.assign(state, { vehicles, models, planWith, modelsChanged });
  state.titles = Object.fromEntries(effects.map(({ name, title }) => [name, title ?? name]));
  fillStarts(byId("start-model"), vehicles, models, "minibalance");
  fillLogs(logs);
  const quietly = (doing) => () => doing().catch((error) => say(error.message, true));
  byId("upload-form").addEventListener("submit", upload);
  byId("log").addEventListener("change", quietly(logChosen));
  byId("start-model").addEventListener("change", quietly(async () => (clearFindings(), showVersions())));
  byId("compare").addEventListener("click", compare);
  byId("diagnose").addEventListener("click", diagnose);
  byId("adopt").addEventListener("click", adopt);
  byId("cancel").addEventListener("click", () => state.job?.id && fetch(`/v1/jobs/${state.job.id}`, { method: "DELETE" }));
  busy(null);
  say(logs.length ? "Choose a log, then compare or diagnose." : "Upload a log of measured power to begin.");
}
