// Talking to the service, and what every part of the page needs of the document.

export const byId = (id) => document.getElementById(id);

export async function fetchJson(path, options) {
  const response = await fetch(path, options);
  const answer = await response.json().catch(() => ({ detail: response.statusText }));
  if (!response.ok) throw Object.assign(new Error(answer.detail ?? answer.title), { problem: answer });
  return answer;
}

export function post(path, body) {
  return fetchJson(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
}

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

// The result of a job; `tell` gets the job whenever it was asked for.
export async function resultOf(job, tell) {
  let now = job;
  while (now.state === "queued" || now.state === "running") {
    tell(now);
    await pause(300);
    now = await fetchJson(`/v1/jobs/${job.id}`);
  }
  if (now.state === "done") return now.result;
  throw new Error(now.state === "cancelled" ? "Cancelled." : now.error.detail);
}

export function element(name, text = "", attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

export function row(table, cells) {
  const line = table.insertRow();
  cells.forEach((cell, k) => {
    const made = element(k === 0 ? "th" : "td");
    if (k === 0) made.scope = "row";
    made.append(cell);
    line.append(made);
  });
  return line;
}
