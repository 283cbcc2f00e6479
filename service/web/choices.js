// What a request starts from: a vehicle, or a version of a model.

const GROUPS = { vehicle: "Vehicles", model: "Versions of the workbench" };

// An entry of a catalogue as an option.
export const optionOf = ({ id, name, title }) => new Option(title ? `${name}: ${title}` : name, id ?? name);

// Fill a list, and choose an entry if the list has it.
export function fill(select, content, wanted) {
  select.replaceChildren(...content);
  if ([...select.options].some(({ value }) => value === wanted)) select.value = wanted;
}

export function fillStarts(select, vehicles, models, wanted = select.value) {
  const entries = Object.entries({ vehicle: vehicles, model: models }).filter(([, list]) => list.length);
  const groups = entries.map(([kind, list]) => {
    const group = document.createElement("optgroup");
    group.label = GROUPS[kind];
    group.append(...list.map(optionOf));
    for (const option of group.children) option.dataset.kind = kind;
    return group;
  });
  fill(select, groups, wanted);
}

// {vehicle: name} or {model: id}, as a request has it.
export function chosen(select) {
  const option = select.selectedOptions[0];
  return option ? { [option.dataset.kind]: option.value } : {};
}
