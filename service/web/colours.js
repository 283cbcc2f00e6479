// Colours of power: blue gives back, then yellow, orange, red to violet for what costs most.

const STOPS = [[255, 224, 138], [249, 142, 60], [214, 48, 79], [107, 26, 123]];
export const GIVEN_BACK = "rgb(38, 110, 220)";

export function powerColour(watts, low, high) {
  if (watts < 0) return GIVEN_BACK;
  const place = Math.min(Math.max((watts - low) / (high - low || 1), 0), 1) * (STOPS.length - 1);
  const k = Math.min(Math.floor(place), STOPS.length - 2);
  const mixed = STOPS[k].map((v, c) => Math.round(v + (STOPS[k + 1][c] - v) * (place - k)));
  return `rgb(${mixed.join(", ")})`;
}

export function powerRange(watts) {
  const sorted = [...watts].sort((a, b) => a - b);
  const at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
  const low = Math.max(0, at(0.02));
  return [low, Math.max(at(0.98), low + 1e-9)];
}
