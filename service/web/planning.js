// Planning: choose a map, a start and a goal; see the route, what it costs and why.

import { Turns, byId, load, post, row } from "./api.js";
import { chosen, fillStarts } from "./choices.js";
import { drawLegend, drawMarkers, drawProfile, drawRoute, svg } from "./drawing.js";
import { drawRelief, frameOf } from "./relief.js";
import { chance, extraCost, extraShare, fixed, joules, metres, seconds, widthFrom } from "./words.js";

const EXCHANGE = ["gravity", "inertia"];
const FIELDS = ["start-x", "start-y", "goal-x", "goal-y"];
// The map, its frame once it is drawn, what was typed for other maps, and the answer on the page
// with the question that it answers.
const state = { map: null, frame: null, places: new Map(), next: "start", titles: {}, shown: null };
const planning = new Turns();
const drawing = new Turns();

function say(text, wrong = false) {
  const message = byId("message");
  message.textContent = text;
  message.classList.toggle("wrong", wrong);
  message.setAttribute("role", wrong ? "alert" : "status");
}

function placeOf(what) {
  const [x, y] = ["x", "y"].map((axis) => byId(`${what}-${axis}`));
  return x.value !== "" && y.value !== "" ? { x: x.valueAsNumber, y: y.valueAsNumber } : null;
}

// What a route depends on, as the service reads it.
function question() {
  return JSON.stringify({
    map: byId("map").value,
    ...chosen(byId("vehicle")),
    start: placeOf("start"),
    goal: placeOf("goal"),
    payload: { mass: byId("payload").valueAsNumber || 0 },
    time_budget_s: byId("budget").valueAsNumber,
  });
}

// To be called after every change of the form: an answer to another question is not awaited, and
// one that is on the page is marked.
function questionChanged() {
  const now = question();
  if (planning.busy && planning.about !== now) {
    planning.abort();
    say("The question was changed while it was planned. Plan again.");
  }
  showBusy();
  if (state.frame) drawMarkers(byId("overlay"), state.frame, { start: placeOf("start"), goal: placeOf("goal") });
  const old = state.shown !== null && state.shown !== now;
  if (old) clearMarks();
  byId("old").hidden = !old;
  for (const id of ["answer", "board"]) byId(id).classList.toggle("old", old);
}

function clearMarks() {
  for (const input of byId("request").querySelectorAll("[aria-invalid]")) input.removeAttribute("aria-invalid");
}

function showBusy() {
  byId("plan").disabled = planning.busy || !state.frame;
  byId("answer").setAttribute("aria-busy", String(planning.busy));
}

function clearAnswer() {
  state.shown = null;
  drawRoute(byId("overlay"), state.frame, null);
  byId("result").hidden = true;
  byId("legend").hidden = true;
  questionChanged();
}

// Places are metres of one map's frame: each map keeps those that were typed for it.
function changePlaces(name) {
  if (state.map) state.places.set(state.map, FIELDS.map((id) => byId(id).value));
  const known = state.places.get(name);
  FIELDS.forEach((id, k) => (byId(id).value = known?.[k] ?? ""));
  Object.assign(state, { map: name, frame: null, next: "start" });
}

async function showMap() {
  const name = byId("map").value;
  const signal = drawing.begin();
  changePlaces(name);
  byId("stage").classList.add("empty");
  clearAnswer();
  say("Loading the map …");
  try {
    const relief = await load(`/v1/maps/${name.split("/").map(encodeURIComponent).join("/")}/relief`, complain, signal);
    state.frame = frameOf(relief);
    drawRelief(byId("relief"), relief);
    const [width, height] = [state.frame.width, state.frame.height].map((v) => v.toFixed(0));
    byId("relief").style.aspectRatio = `${width} / ${height}`;
    byId("stage").classList.remove("empty");
    questionChanged();
    say("Choose a start and a goal.");
  } catch (error) {
    if (!signal.aborted) complain(error);
  }
}

function choose(event) {
  if (!state.frame) return;
  const box = byId("overlay").getBoundingClientRect();
  const scale = state.frame.width / box.width;
  const [x, y] = state.frame.toMetres((event.clientX - box.left) * scale, (event.clientY - box.top) * scale);
  byId(`${state.next}-x`).value = x.toFixed(state.frame.digits);
  byId(`${state.next}-y`).value = y.toFixed(state.frame.digits);
  state.next = state.next === "start" ? "goal" : "start";
  questionChanged();
  if (placeOf("start") && placeOf("goal") && state.next === "start") byId("request").requestSubmit();
}

function showAnswer(answer) {
  if (answer.status !== "ok") {
    say(`No route: ${answer.reason}`, true);
    return;
  }
  const best = answer.routes[0];
  const others = Object.entries(answer.baselines);
  say(`${joules(best.energy_j)} over ${metres(best.length_m)} in ${seconds(best.duration_s)}` +
    others.map(([name, other], n) => `${n ? "," : ";"} the ${name} route ${extraCost(other.energy_j, best.energy_j)}`).join("") + ".");
  drawRoute(byId("overlay"), state.frame, best);
  drawLegend(byId("legend"), best);
  const comparison = byId("comparison").tBodies[0];
  comparison.replaceChildren();
  for (const [name, route] of [["route", best], ...others]) {
    const called = name === "route" ? `route (least ${answer.planner.objective ?? "energy"})` : name;
    row(comparison, [called, joules(route.energy_j), name === "route" ? "" : extraShare(route.energy_j, best.energy_j), metres(route.length_m), seconds(route.duration_s)]);
  }
  showAccount(best);
  drawProfile(byId("profile"), best);
  const [low, high] = best.energy_interval_j;
  const remarks = [
    `Energy of one drive: ${joules(low)} … ${joules(high)} (95 %).`,
    ...(best.sensitivity?.length ? [`The interval's width comes from ${widthFrom(best.sensitivity, state.titles)}.`] : []),
    `No feasible route of this motion model costs less than ${joules(best.lower_bound_j)}.`,
    ...(best.battery ? [`It ${best.battery.fits ? "fits" : "does not fit"} the battery${"chance" in best.battery ? `; the chance that the battery suffices is ${chance(best.battery.chance)}` : ""}.`] : []),
    ...Object.entries(answer.baselines_absent ?? {}).map(([name, why]) => `Nothing to compare with as the ${name}: ${why}.`),
    ...answer.notes,
  ];
  byId("remarks").replaceChildren(...remarks.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  byId("result").hidden = false;
}

function showAccount(route) {
  const account = byId("account").tBodies[0];
  account.replaceChildren();
  const parts = Object.entries(route.breakdown_j).filter(([, value]) => joules(value) !== joules(0));
  parts.sort(([a, u], [b, v]) => EXCHANGE.includes(a) - EXCHANGE.includes(b) || Math.abs(v) - Math.abs(u));
  const most = Math.max(...parts.map(([, value]) => Math.abs(value)));
  for (const [slug, value] of parts) {
    const exchange = EXCHANGE.includes(slug);
    const bar = svg("svg", { viewBox: "0 0 100 12", preserveAspectRatio: "none", "aria-hidden": "true" });
    svg("rect", { width: (100 * Math.abs(value)) / most, height: 12, rx: 1.5, fill: exchange ? "#7c5cc4" : "#c2662d" }, bar);
    const name = (state.titles[slug] ?? slug) + (exchange ? " (exchange)" : "");
    row(account, [name, bar, joules(value), `${fixed((100 * value) / route.energy_j, 1)} %`]);
  }
}

async function plan(event) {
  event.preventDefault();
  if (!state.frame) return;
  const asked = question();
  const signal = planning.begin(asked);
  clearMarks();
  clearAnswer();
  say("Planning …");
  try {
    showAnswer(await post("/v1/routes", asked, signal));
    state.shown = asked;
  } catch (error) {
    if (signal.aborted) return;
    complain(error);
    // A refusal is an answer too.
    if (error.problem) state.shown = asked;
    const what = error.problem?.field?.split(".")[0];
    for (const id of [`${what}-x`, `${what}-y`]) byId(id)?.setAttribute("aria-invalid", "true");
  } finally {
    planning.end(signal);
    showBusy();
  }
}

function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map(({ name, title }) => new Option(title ? `${name}: ${title}` : name, name)));
  if (entries.some(({ name }) => name === chosen)) select.value = chosen;
}

// Choose a version of a model for the next route, and plan it where start and goal are set.
export function planWith(model) {
  byId("vehicle").value = model;
  byId("request").scrollIntoView({ behavior: "smooth", block: "start" });
  questionChanged();
  if (!state.frame) return;
  if (placeOf("start") && placeOf("goal")) byId("request").requestSubmit();
  else say("Choose a start and a goal.");
}

// The versions of models as they are now; the question changes with one that is gone.
export function offerModels(vehicles, models) {
  fillStarts(byId("vehicle"), vehicles, models);
  questionChanged();
}

export function beginPlanning(maps, vehicles, models, effects) {
  fill(byId("map"), maps, "jacksboro-1to100");
  fillStarts(byId("vehicle"), vehicles, models, "minibalance");
  state.titles = Object.fromEntries(effects.map(({ name, title }) => [name, title]));
  byId("choices").disabled = false;
  byId("map").addEventListener("change", showMap);
  byId("stage").addEventListener("click", choose);
  byId("request").addEventListener("submit", plan);
  byId("request").addEventListener("input", questionChanged);
  showMap();
}

export const complain = (error) => say(error.message, true);
