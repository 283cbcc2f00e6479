// Talking to the service, and what every part of the page needs of the document.

export const byId = (id) => document.getElementById(id);

// Nobody answers, or a proxy says that nobody does: the question is still to be asked.
class ServerLost extends Error {
  constructor() {
    super("The server does not answer. Start it with `joulepath serve` and try again.");
  }
}

const NOBODY = [502, 503, 504]; // from a proxy; the service itself sends a problem with them
const PATIENCE_MS = 1000; // between two attempts to reach a lost server

let asking = null; // the person is asked once, however many requests wait for the key

// Ask for the API key until the service takes it; the service keeps it in a cookie.
async function askForKey() {
  const dialog = byId("key");
  const form = dialog.querySelector("form");
  for (;;) {
    dialog.showModal();
    await new Promise((resolve) => dialog.addEventListener("close", resolve, { once: true }));
    const body = JSON.stringify({ key: form.elements.key.value });
    const answer = await fetch("/key", { method: "POST", headers: { "Content-Type": "application/json" }, body });
    if (answer.ok) return;
    byId("key-wrong").hidden = false;
  }
}

// An answer in lines of JSON: `tell` gets each progress, the last line has the answer or {problem}.
async function lastLine(response, tell) {
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let last = null;
  let rest = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return last?.progress ? null : (last?.answer ?? last);
    const lines = (rest + value).split("\n");
    rest = lines.pop();
    for (const line of lines) {
      last = JSON.parse(line);
      if (last.progress) tell(last.progress);
    }
  }
}

const read = (response, tell) =>
  response.headers.get("Content-Type")?.startsWith("application/x-ndjson") ? lastLine(response, tell) : response.json();

const refusal = (problem, otherwise) => Object.assign(new Error(problem?.detail ?? problem?.title ?? otherwise), { problem });

// The answer as JSON. A signal that was aborted lets no answer through, however late it was.
// `tell` gets the progress of an answer that reports any.
export async function fetchJson(path, options = {}, tell = () => {}) {
  const lost = () => {
    options.signal?.throwIfAborted();
    throw new ServerLost();
  };
  const response = await fetch(path, options).catch(lost);
  if (response.status === 401) {
    asking ??= askForKey().finally(() => (asking = null));
    await asking.catch(lost);
    return fetchJson(path, options, tell);
  }
  const answer = await read(response, tell).catch((error) => (error instanceof SyntaxError ? null : lost()));
  options.signal?.throwIfAborted();
  if (answer === null && (response.ok || NOBODY.includes(response.status))) throw new ServerLost();
  if (!response.ok) throw refusal(answer, response.statusText);
  // What went wrong after progress was reported.
  if (answer.problem) throw refusal(answer.problem);
  return answer;
}

// The body is JSON text.
export function post(path, body, signal, tell) {
  const headers = { "Content-Type": "application/json" };
  return fetchJson(path, { method: "POST", headers, body, signal }, tell);
}

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

// What is only read: a lost server is asked again until it is back; `complain` gets each failure.
export async function load(path, complain, signal) {
  for (;;) {
    try {
      return await fetchJson(path, { signal });
    } catch (error) {
      if (!(error instanceof ServerLost)) throw error;
      complain(error);
    }
    await pause(PATIENCE_MS);
  }
}

// The result of a job; `tell` gets the job whenever it was asked for.
export async function resultOf(job, tell, complain, signal) {
  let now = job;
  while (now.state === "queued" || now.state === "running") {
    tell(now);
    await pause(300);
    now = await load(`/v1/jobs/${job.id}`, complain, signal);
  }
  if (now.state === "done") return now.result;
  throw new Error(now.state === "cancelled" ? "Cancelled." : now.error.detail);
}

// Work of which only the latest counts. Each answer is fetched and shown under the signal of its
// turn, which is aborted when another one begins or when its question is no longer asked.
export class Turns {
  #running = null;
  about = null;

  begin(about = null) {
    this.abort();
    this.#running = new AbortController();
    this.about = about;
    return this.#running.signal;
  }

  // Load several paths and show what they answer, unless another turn has begun.
  async load(paths, show, complain) {
    const signal = this.begin();
    try {
      show(...(await Promise.all(paths.map((path) => load(path, complain, signal)))));
    } catch (error) {
      if (!signal.aborted) complain(error);
    }
  }

  abort() {
    this.#running?.abort();
    this.#running = null;
  }

  end(signal) {
    if (this.#running?.signal === signal) this.#running = null;
  }

  get busy() {
    return this.#running !== null;
  }
}

export function element(name, text = "", attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// What has the focus loses it when it is disabled or hidden. It gets it back by the function that
// is returned, or `instead` where it is gone for good; not where a person went on meanwhile.
export function holdFocus(instead) {
  const held = document.activeElement;
  const lost = () => document.activeElement === document.body || !document.activeElement.checkVisibility();
  return () => {
    if (held === document.body || !lost()) return;
    held.focus();
    if (lost()) instead.focus();
  };
}

// A list of sentences.
export const list = (id, sentences) => byId(id).replaceChildren(...sentences.map((sentence) => element("li", sentence)));

// A report of the service as elements. The service escapes foreign text, and the policy of this
// page runs no script that might be in it.
export function fragment(report) {
  const made = document.createElement("template");
  made.innerHTML = report;
  return made.content;
}

// A function that shows a sentence in an element, a wrong one as an alert.
export const sayIn = (id) => (sentence, wrong = false) => {
  const message = byId(id);
  message.textContent = sentence;
  message.classList.toggle("wrong", wrong);
  message.setAttribute("role", wrong ? "alert" : "status");
};
