// The workbench: a measured log, where the model fails, what is missing, and versions that learn it.

import { Turns, byId, element, fetchJson, load, post, resultOf, row } from "./api.js";
import { chosen, fillStarts } from "./choices.js";
import { drawCurves, drawErrors, drawShape, drawVersions } from "./charts.js";
import { estimate, fixed, percent, signedWatts, watts } from "./words.js";

// First versions, by how they came about.
const STARTS = { fit: "base model", stated: "base model as stated" };
const WHAT_NEXT = "Choose a log, then compare or diagnose.";
// `locked` while choosing is not possible; `shown` is the question that the findings answer.
const state = { vehicles: [], models: [], titles: {}, job: null, locked: false, first: "", shown: null, planWith: null, modelsChanged: null };
const working = new Turns();
const notes = new Turns();
const versions = new Turns();

function say(text, wrong = false) {
  const message = byId("work-message");
  message.textContent = text;
  message.classList.toggle("wrong", wrong);
  message.setAttribute("role", wrong ? "alert" : "status");
}

const complain = (error) => say(error.message, true);

const asked = () => ({ log: byId("log").value, ...chosen(byId("start-model")) });
const question = () => JSON.stringify(asked());

// What may be pressed now, and whether the findings answer what is chosen now.
function refresh() {
  const busy = working.busy;
  const old = state.shown !== null && state.shown !== question();
  const found = !byId("comparison-card").hidden || !byId("diagnosis-card").hidden;
  byId("old-findings").hidden = !old || !found;
  for (const id of ["comparison-card", "diagnosis-card"]) byId(id).classList.toggle("old", old);
  const none = !byId("log").options.length;
  byId("log").disabled = none || state.locked;
  byId("start-model").disabled = state.locked;
  for (const id of ["compare", "diagnose"]) byId(id).disabled = busy || none;
  for (const id of ["log-file", "mapping-file", "upload"]) byId(id).disabled = busy;
  byId("adopt").disabled = busy || old;
  for (const button of byId("versions").querySelectorAll("button")) button.disabled = busy;
  byId("work").hidden = !busy;
  byId("findings").setAttribute("aria-busy", String(busy));
}

function showProgress(job) {
  state.job = job;
  const { share, sentence } = job.progress ?? { share: 0, sentence: "" };
  if (share > 0) byId("work-progress").value = share;
  else byId("work-progress").removeAttribute("value");
  say(sentence ? `${sentence[0].toUpperCase()}${sentence.slice(1)} …` : state.first);
}

// Carry out something that may be a job. With `about`, the question that it answers, choosing
// another one ends it; without, choosing waits.
async function work(first, { about = null, begin, show }) {
  const signal = working.begin(about);
  state.locked = about === null;
  state.first = first;
  showProgress({});
  refresh();
  try {
    // Not under the signal: a job that was begun must be known to be ended.
    const answer = await begin();
    if (signal.aborted) await end(answer);
    else await show(answer.state ? await resultOf(answer, showProgress, complain, signal) : answer, signal);
  } catch (error) {
    if (!signal.aborted) complain(error);
  }
  if (signal.aborted) return;
  working.end(signal);
  state.locked = false;
  refresh();
}

// End a job that nobody waits for; a version that it has made all the same is offered.
async function end(job) {
  if (!job?.id) return;
  const ended = await fetchJson(`/v1/jobs/${job.id}`, { method: "DELETE" });
  if (ended.state === "done" && ended.kind === "adopt") await offerModels();
}

function questionChanged() {
  if (working.busy && working.about !== null && working.about !== question()) {
    working.abort();
    say("Stopped, as the log or the model was changed.");
    end(state.job).catch(complain);
  } else if (!working.busy) {
    say(WHAT_NEXT);
  }
  refresh();
}

function fillLogs(logs, wanted) {
  const options = logs.map(({ id, name, rows, runs }) => new Option(`${name}: ${rows.toLocaleString("en")} rows, ${runs} runs`, id));
  byId("log").replaceChildren(...options);
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
  work(`Sending ${file.name} …`, {
    begin: () => fetchJson("/v1/logs?wait=0", { method: "POST", body: form }),
    show: async (log) => {
      fillLogs(await load("/v1/logs", complain), log.id);
      notes.abort();
      showLog(log);
      byId("upload-form").reset();
      clearFindings();
      say(`${log.name} was read: ${log.rows.toLocaleString("en")} rows in ${log.runs} runs.`);
    },
  });
}

function showLog(log) {
  const remarks = [...log.report.map(({ sentence }) => sentence), ...log.derived.map((s) => `Derived: ${s}`), ...log.assumed.map((s) => `Assumed: ${s}`)];
  byId("log-notes").replaceChildren(...remarks.map((remark) => element("li", remark)));
  byId("log-remarks").hidden = !remarks.length;
}

async function logChosen() {
  questionChanged();
  byId("log-remarks").hidden = true;
  const signal = notes.begin();
  try {
    showLog(await load(`/v1/logs/${byId("log").value}`, complain, signal));
  } catch (error) {
    if (!signal.aborted) complain(error);
  }
}

function startChosen() {
  questionChanged();
  showVersions();
}

function clearFindings() {
  state.shown = null;
  byId("comparison-card").hidden = true;
  byId("diagnosis-card").hidden = true;
  refresh();
}

// Ask a verb about the log and the model that are chosen; findings to another question go first.
function ask(verb, first, show, more = {}) {
  const about = question();
  work(first, {
    about,
    begin: () => post(`/v1/${verb}`, JSON.stringify({ ...asked(), ...more })),
    show: async (found, signal) => {
      if (state.shown !== about) clearFindings();
      state.shown = about;
      await show(found, signal);
    },
  });
}

function compare() {
  ask("compare", "Comparing …", (found) => {
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
  const refused = found.refused_fit ? ` ${found.refused_fit.sentence}` : "";
  byId("comparison-sentence").textContent =
    `${found.model.name} v${found.model.version} misses the measured power by ${watts(found.rmse_w)} rms${heldout}; ` +
    `the log's own noise is about ${watts(found.noise_floor_w)}. Energy: ${fixed(Math.abs(off), 1)} % too ${off < 0 ? "low" : "high"}.${refused}`;
  showRegimes(byId("regimes"), found.regimes);
  drawCurves(byId("curves"), found.pictures.curves, found.noise_floor_w);
}

function diagnose() {
  ask("diagnose", "Diagnosing …", (found) => {
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
      `${name} ${estimate(value, stderr)} ${unit === "1" ? "" : unit}`.trim());
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
  const effects = [byId("adopt-what").value];
  ask("adopt", "Adopting …", async (found, signal) => {
    await offerModels();
    if (signal.aborted) return;
    choose(found.model_id);
    const warnings = [...new Set(found.warnings)].map((warning) => ` Warning: ${warning}.`).join("");
    say(`Adopted ${found.adopted.map(title).join(" + ")}: held-out error ${watts(found.before.heldout_rmse_w)} → ` +
      `${watts(found.after.heldout_rmse_w)}, noise ${watts(found.noise_floor_w)}.${warnings}`);
  }, { effects });
}

// The versions as they are now, above and below; what is chosen stays.
async function offerModels() {
  state.models = await load("/v1/models", complain);
  state.modelsChanged(state.models);
  fillStarts(byId("start-model"), state.vehicles, state.models);
  refresh();
}

// Start from a version that was just made; what was found before is done with.
function choose(id) {
  fillStarts(byId("start-model"), state.vehicles, state.models, id);
  clearFindings();
  showVersions();
}

async function showVersions() {
  const { model } = chosen(byId("start-model"));
  const signal = versions.begin();
  byId("versions-card").hidden = true;
  if (!model) return;
  try {
    const entries = await load(`/v1/models/${model}/history`, complain, signal);
    byId("versions-card").hidden = false;
    fillVersions(model, entries);
    refresh();
  } catch (error) {
    if (!signal.aborted) complain(error);
  }
}

function fillVersions(model, entries) {
  drawVersions(byId("fall"), entries);
  const body = byId("versions").tBodies[0];
  body.replaceChildren();
  for (const entry of entries) {
    const what = STARTS[entry.action] ?? (entry.action === "adopt" ? entry.adopted.map(title).join(" + ") : `back to version ${entry.reverted_to ?? "?"}`);
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
  work("Going back …", {
    begin: () => post(`/v1/models/${model}/revert`, JSON.stringify({ version })),
    show: async (made) => {
      await offerModels();
      choose(made.id);
      say(`Version ${made.version} is as version ${version} was.`);
    },
  });
}

export function beginWorkbench({ vehicles, effects, models, logs, planWith, modelsChanged }) {
  Object.assign(state, { vehicles, models, planWith, modelsChanged });
  state.titles = Object.fromEntries(effects.map(({ name, title }) => [name, title ?? name]));
  fillStarts(byId("start-model"), vehicles, models, "minibalance");
  fillLogs(logs);
  byId("upload-form").addEventListener("submit", upload);
  byId("log").addEventListener("change", logChosen);
  byId("start-model").addEventListener("change", startChosen);
  byId("compare").addEventListener("click", compare);
  byId("diagnose").addEventListener("click", diagnose);
  byId("adopt").addEventListener("click", adopt);
  byId("cancel").addEventListener("click", () => end(state.job).catch(complain));
  refresh();
  say(logs.length ? WHAT_NEXT : "Upload a log of measured power to begin.");
}
