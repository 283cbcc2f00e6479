// What a request starts from: a vehicle, or a version of a model.

import { watts } from "./words.js";

const GROUPS = [["vehicle", "Vehicles"], ["model", "Versions of the workbench"]];

export function modelLabel({ name, version, adopted, heldout_rmse_w: error }) {
  const what = adopted.length ? `, ${adopted.join(" + ")}` : "";
  return `${name} v${version}${what}${error === null ? "" : `: ${watts(error)}`}`;
}

export function fillStarts(select, vehicles, models, wanted = select.value) {
  const options = {
    vehicle: vehicles.map(({ name, title }) => new Option(title ? `${name}: ${title}` : name, name)),
    model: models.map((model) => new Option(modelLabel(model), model.id)),
  };
  select.replaceChildren();
  for (const [kind, label] of GROUPS) {
    if (!options[kind].length) continue;
    const group = document.createElement("optgroup");
    group.label = label;
    for (const option of options[kind]) option.dataset.kind = kind;
    group.append(...options[kind]);
    select.append(group);
  }
  if ([...select.options].some(({ value }) => value === wanted)) select.value = wanted;
}

// {vehicle: name} or {model: id}, as a request has it.
export function chosen(select) {
  const option = select.selectedOptions[0];
  return option ? { [option.dataset.kind]: option.value } : {};
}
