// Planning: choose a map, a start and a goal; see the route, what it costs and why.

import { Turns, byId, fragment, holdFocus, post, sayIn } from "./api.js";
import { chosen, fill, fillStarts, optionOf } from "./choices.js";
import { offerDownloads, withdrawDownloads } from "./downloads.js";
import { beginGround, drawGround, forgetGround, loadGround } from "./ground.js";

const ENDS = ["start", "goal"];
const FIELDS = ["start-x", "start-y", "goal-x", "goal-y"];
const ANSWER = ["legend", "result", "along"];
// Planned when the page opens, if the service has its map; the first input takes its place.
const EXAMPLE = { map: "jacksboro-1to100", places: [93, 225, 212, 73] };
// The map, what was typed for other maps, the end that a click sets, and the question that the
// answer on the page answers; whether what is planned is the example that nobody asked for.
const state = { map: null, places: new Map(), next: "start", shown: null, example: false };
const planning = new Turns();
const drawing = new Turns();

const say = sayIn("message");
export const complain = (error) => say(error.message, true);

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
    certify_s: 0.5,
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
  ENDS.forEach(showMarker);
  const old = state.shown !== null && state.shown !== now;
  if (old) clearMarks();
  byId("old").hidden = !old;
  for (const id of ["answer", "board", "along"]) byId(id).classList.toggle("old", old);
}

function clearMarks() {
  for (const input of byId("request").querySelectorAll("[aria-invalid]")) input.removeAttribute("aria-invalid");
}

function showBusy() {
  byId("plan").disabled = planning.busy || !picture();
  byId("planning").hidden = !planning.busy;
  byId("answer").setAttribute("aria-busy", String(planning.busy));
}

function showProgress({ share, sentence }) {
  byId("plan-progress").value = share;
  say(`${sentence[0].toUpperCase()}${sentence.slice(1)} …`);
}

function cancel() {
  planning.abort();
  say("Cancelled.");
  showBusy();
}

function clearAnswer() {
  state.shown = null;
  for (const drawn of byId("picture").querySelectorAll(".routes, .here")) drawn.remove();
  for (const id of ANSWER) byId(id).replaceChildren();
  withdrawDownloads();
  questionChanged();
}

// The map's picture, null while there is none. It says itself where its corner is, in metres, and
// how many pixels a metre has.
const picture = () => byId("picture").firstElementChild;

function frame() {
  const [x0, y1, scale] = ["x0", "y1", "scale"].map((key) => Number(picture().dataset[key]));
  return { x0, y1, scale, size: picture().viewBox.baseVal };
}

function showMarker(what) {
  const marker = byId(`${what}-marker`);
  const place = placeOf(what);
  marker.hidden = !place || !picture();
  if (marker.hidden) return;
  const { x0, y1, scale, size } = frame();
  marker.style.left = `${(100 * scale * (place.x - x0)) / size.width}%`;
  marker.style.top = `${(100 * scale * (y1 - place.y)) / size.height}%`;
}

// Places are metres of one map's frame: each map keeps those that were typed for it.
function changePlaces(name) {
  if (state.map) state.places.set(state.map, FIELDS.map((id) => byId(id).value));
  const known = state.places.get(name);
  FIELDS.forEach((id, k) => (byId(id).value = known?.[k] ?? ""));
  Object.assign(state, { map: name, next: "start" });
}

function showMap() {
  const name = byId("map").value;
  changePlaces(name);
  byId("picture").replaceChildren();
  forgetGround();
  clearAnswer();
  say("Loading the map …");
  const path = name.split("/").map(encodeURIComponent).join("/");
  const show = ({ report }) => {
    byId("picture").replaceChildren(fragment(report));
    questionChanged();
    say("Choose a start and a goal.");
    showGround();
    if (state.example) planExample();
  };
  drawing.load([`/v1/maps/${path}/relief?most=16&report=true`], show, complain);
}

const showGround = () => picture() && loadGround(byId("map").value, chosen(byId("vehicle")));

function planExample() {
  FIELDS.forEach((id, k) => (byId(id).value = EXAMPLE.places[k]));
  byId("request").requestSubmit();
}

// The first input of a person ends the example, and what stands there is theirs.
function endExample({ target }) {
  if (!state.example) return;
  state.example = false;
  if (!planning.busy) return;
  planning.abort();
  for (const id of FIELDS) if (byId(id) !== target) byId(id).value = "";
  questionChanged();
  say("Choose a start and a goal.");
}

function choose(event) {
  if (!picture()) return;
  const { x0, y1, scale, size } = frame();
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(picture().getScreenCTM().inverse());
  const digits = Math.max(0, Math.min(3, Math.ceil(-Math.log10(size.width / scale / 2000))));
  byId(`${state.next}-x`).value = (x0 + at.x / scale).toFixed(digits);
  byId(`${state.next}-y`).value = (y1 - at.y / scale).toFixed(digits);
  state.next = state.next === "start" ? "goal" : "start";
  questionChanged();
  if (placeOf("start") && placeOf("goal") && state.next === "start") byId("request").requestSubmit();
}

// The report's map becomes the one that is clicked; its table stands beside it, the rest below.
function showAnswer(answer) {
  const { status, report } = answer;
  const section = fragment(report).firstElementChild;
  const part = (selector) => section.querySelector(selector);
  say(part(".lead, .reason").textContent, status !== "ok");
  if (status !== "ok") return;
  window.linkCursor(section);
  byId("picture").replaceChildren(part("svg.map"));
  drawGround();
  offerDownloads(answer);
  byId("legend").replaceChildren(part("figcaption"));
  byId("result").replaceChildren(...part(".top > div").childNodes);
  for (const shown of [part(".lead"), part(".top")]) shown.remove();
  byId("along").replaceChildren(section);
}

async function plan(event) {
  event.preventDefault();
  if (!picture()) return;
  const asked = question();
  const focusBack = holdFocus(byId("message"));
  const signal = planning.begin(asked);
  clearMarks();
  clearAnswer();
  say(state.example ? "Planning an example …" : "Planning …");
  byId("plan-progress").removeAttribute("value");
  const tell = (progress) => signal.aborted || showProgress(progress);
  try {
    showAnswer(await post("/v1/routes?report=true&files=true&progress=true", asked, signal, tell));
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
    if (!planning.busy) focusBack();
  }
}

// Choose a version of a model for the next route, and plan it where start and goal are set.
export function planWith(model) {
  state.example = false;
  byId("vehicle").value = model;
  byId("request").scrollIntoView({ behavior: "smooth", block: "start" });
  byId("vehicle").focus({ preventScroll: true });
  questionChanged();
  if (!picture()) return;
  if (placeOf("start") && placeOf("goal")) byId("request").requestSubmit();
  else say("Choose a start and a goal.");
}

// The versions of models as they are now; the question changes with one that is gone.
export function offerModels(vehicles, models) {
  fillStarts(byId("vehicle"), vehicles, models);
  questionChanged();
}

export function beginPlanning(maps, vehicles, models) {
  fill(byId("map"), maps.map(optionOf), EXAMPLE.map);
  fillStarts(byId("vehicle"), vehicles, models, "minibalance");
  byId("choices").disabled = false;
  byId("map").addEventListener("change", showMap);
  byId("vehicle").addEventListener("change", showGround);
  byId("cancel-plan").addEventListener("click", cancel);
  for (const input of ["pointerdown", "keydown", "input"]) {
    for (const id of ["stage", "request"]) byId(id).addEventListener(input, endExample);
  }
  byId("stage").addEventListener("click", choose);
  byId("request").addEventListener("submit", plan);
  byId("request").addEventListener("input", questionChanged);
  beginGround();
  state.example = byId("map").value === EXAMPLE.map;
  showMap();
}
