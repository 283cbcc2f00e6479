// The workbench: a measured log, where the model fails, what is missing, and versions that learn it.

import { Turns, byId, element, fetchJson, fragment, holdFocus, list, load, post, resultOf, sayIn } from "./api.js";
import { chosen, fill, fillStarts } from "./choices.js";

const WHAT_NEXT = "Choose a log, then compare or diagnose.";
const DEMO_VEHICLE = "minibalance";
const CARDS = ["diagnosis-card", "comparison-card"];
// `locked` while choosing is not possible; `shown` is the question that the findings answer.
const state = { vehicles: [], models: [], titles: {}, job: null, locked: false, first: "", shown: null, planWith: null, modelsChanged: null };
const working = new Turns();
const notes = new Turns();
const versions = new Turns();

const say = sayIn("work-message");
const complain = (error) => say(error.message, true);

const asked = () => ({ log: byId("log").value, ...chosen(byId("start-model")) });
const question = () => JSON.stringify(asked());

// What may be pressed now, and whether the findings answer what is chosen now.
function refresh() {
  const busy = working.busy;
  const old = state.shown !== null && state.shown !== question();
  byId("old-findings").hidden = !old || CARDS.every((id) => byId(id).hidden);
  for (const id of CARDS) byId(id).classList.toggle("old", old);
  const none = !byId("log").options.length;
  byId("log").disabled = none || state.locked;
  byId("start-model").disabled = state.locked;
  for (const id of ["compare", "diagnose"]) byId(id).disabled = busy || none;
  for (const id of ["log-file", "mapping-file", "upload", "demo-log"]) byId(id).disabled = busy;
  byId("adopt").disabled = busy || old;
  for (const button of byId("versions-card").querySelectorAll("button")) button.disabled = busy;
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
  const focusBack = holdFocus(byId("work-message"));
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
  focusBack();
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

const sizeOf = ({ rows, runs }) => [`${rows.toLocaleString("en")} rows`, `${runs} runs`];

function fillLogs(logs, wanted) {
  const options = logs.map((log) => new Option(`${log.name}: ${sizeOf(log).join(", ")}`, log.id));
  fill(byId("log"), options, wanted);
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
      await chooseLog(log);
      byId("upload-form").reset();
      const known = log.name === file.name ? "" : `${file.name} was uploaded before: `;
      say(`${known}${log.name} was read: ${sizeOf(log).join(" in ")}.`);
    },
  });
}

// A log of a simulated robot that has an effect which its vehicle's model lacks.
function demoLog() {
  work("Driving a simulated robot …", {
    begin: () => fetchJson("/v1/logs/demo?wait=0", { method: "POST" }),
    show: async (log) => {
      await chooseLog(log);
      fillStarts(byId("start-model"), state.vehicles, state.models, DEMO_VEHICLE);
      showVersions();
      say(`${log.name} was read: ${sizeOf(log).join(" in ")}. The robot hides an effect: press Diagnose.`);
    },
  });
}

async function chooseLog(log) {
  fillLogs(await load("/v1/logs", complain), log.id);
  notes.abort();
  showLog(log);
  clearFindings();
}

function showLog({ report, derived, assumed }) {
  const remarks = [...report.map(({ sentence }) => sentence), ...derived.map((s) => `Derived: ${s}`), ...assumed.map((s) => `Assumed: ${s}`)];
  list("log-notes", remarks);
  byId("log-remarks").hidden = !remarks.length;
}

function logChosen() {
  questionChanged();
  byId("log-remarks").hidden = true;
  notes.load([`/v1/logs/${byId("log").value}`], showLog, complain);
}

function startChosen() {
  questionChanged();
  showVersions();
}

function clearFindings() {
  state.shown = null;
  for (const id of CARDS) byId(id).hidden = true;
  refresh();
}

// Ask a verb about the log and the model that are chosen; findings to another question go first.
function ask(verb, first, show, more = {}) {
  const about = question();
  work(first, {
    about,
    begin: () => post(`/v1/${verb}?report=true`, JSON.stringify({ ...asked(), ...more })),
    show: async (found, signal) => {
      if (state.shown !== about) clearFindings();
      state.shown = about;
      await show(found, signal);
    },
  });
}

function showReport(what, report) {
  byId(what).replaceChildren(fragment(report));
  byId(`${what}-card`).hidden = false;
}

// What was found last stands first.
function showFound(what, report) {
  byId("old-findings").after(byId(`${what}-card`));
  showReport(what, report);
}

function compare() {
  ask("compare", "Comparing …", ({ report }) => {
    showFound("comparison", report);
    say("Compared.");
  });
}

function diagnose() {
  ask("diagnose", "Diagnosing …", (found) => {
    showFound("diagnosis", found.report);
    offerToAdopt(found);
    say("Diagnosed.");
  });
}

// As sentences have it, the slug, and what it stands for.
const title = (slug) => (state.titles[slug] ? `${slug} (${state.titles[slug]})` : slug);

// All that the diagnosis proposes, and each other effect that the log can tell.
function offerToAdopt({ selected, outside_catalogue: outside, candidates }) {
  const proposed = [...selected, ...(outside?.name ? [outside.name] : [])];
  const others = candidates.filter(({ effect, testable }) => testable !== false && !proposed.includes(effect));
  const options = others.map(({ effect }) => new Option(title(effect), effect));
  if (proposed.length) options.unshift(new Option(proposed.map(title).join(" + "), "diagnosed"));
  fill(byId("adopt-what"), options);
  byId("adoption").hidden = !options.length;
}

function adopt() {
  const effects = [byId("adopt-what").value];
  ask("adopt", "Adopting …", async ({ model_id: model, report }, signal) => {
    await offerModels();
    if (signal.aborted) return;
    choose(model);
    const sentences = fragment(report).querySelectorAll(".verdict :is(.lead, .warning)");
    say([...sentences].map(({ textContent }) => textContent).join(" "));
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

function showVersions() {
  const { model } = chosen(byId("start-model"));
  byId("versions-card").hidden = true;
  versions.abort();
  if (!model) return;
  const show = (entries, { report }) => {
    showReport("versions", report);
    entries.forEach((entry, k) => offerVersion(model, entry, k + 1 === entries.length, byId("versions").querySelector("tbody").rows[k]));
    refresh();
  };
  versions.load([`/v1/models/${model}/history`, `/v1/models/${model}/report`], show, complain);
}

// What can be done with a version, below its number: the end of its row may need scrolling. The
// last one stands already.
function offerVersion(model, { id, version }, last, row) {
  const cell = row.cells[0];
  const button = (words, press) => {
    const made = element("button", words, { type: "button", class: "plain" });
    made.addEventListener("click", press);
    cell.append(made);
  };
  if (id) {
    button("Plan with it", () => state.planWith(id));
    cell.append(element("a", "File", { href: `/v1/models/${id}`, download: `model-v${version}.json` }));
  }
  if (!last) button("Back to it", () => revert(model, version));
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
  const cancel = () => end(state.job).catch(complain);
  byId("upload-form").addEventListener("submit", upload);
  byId("demo-log").addEventListener("click", demoLog);
  byId("log").addEventListener("change", logChosen);
  byId("start-model").addEventListener("change", startChosen);
  for (const [id, press] of Object.entries({ compare, diagnose, adopt, cancel })) byId(id).addEventListener("click", press);
  refresh();
  say(logs.length ? WHAT_NEXT : "Upload a log of measured power to begin. Or try the demo log: its robot hides an effect.");
}
