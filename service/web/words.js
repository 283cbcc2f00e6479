// How quantities are written for people; the same rules as on the command line.

// A value as far as so many digits after the point show it; what they do not show is zero, and zero
// has no sign.
export const rounded = (value, digits) => Number(value.toFixed(digits)) + 0;

export const fixed = (value, digits) =>
  rounded(value, digits).toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits });

// Digits after the point that show so many significant ones of the largest value.
export function digitsFor(values, significant) {
  const most = values.reduce((a, b) => Math.max(a, Math.abs(b)), 0);
  return most > 0 ? Math.min(Math.max(significant - 1 - Math.floor(Math.log10(most)), 0), 100) : 0;
}

export function joules(value) {
  const size = Math.abs(value);
  if (size >= 1e6) return `${fixed(value / 1e6, 2)} MJ`;
  if (size >= 1e4) return `${fixed(value / 1e3, 2)} kJ`;
  return size >= 1000 ? `${fixed(value, 0)} J` : `${fixed(value, 1)} J`;
}

export function metres(value) {
  return value < 100 ? `${fixed(value, 2)} m` : `${fixed(value, 0)} m`;
}

export function seconds(value) {
  if (value < 60) return `${fixed(value, 1)} s`;
  const whole = Math.round(value);
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${String(whole % 60).padStart(2, "0")} s`;
  return `${Math.floor(whole / 3600)} h ${String(Math.floor(whole / 60) % 60).padStart(2, "0")} min`;
}

export function extraCost(energy, best) {
  if (best <= 0) return `costs ${joules(energy - best)} more`;
  const share = energy / best - 1;
  if (Math.abs(share) < 0.0005) return "costs the same";
  const digits = Math.abs(share) >= 0.1 ? 0 : 1;
  return `costs ${(100 * Math.abs(share)).toFixed(digits)} % ${share > 0 ? "more" : "less"}`;
}

// The same in a table: +14 %.
export function extraShare(energy, best) {
  if (best <= 0) return `+${joules(energy - best)}`;
  const share = 100 * (energy / best - 1);
  const digits = Math.abs(share) >= 10 ? 0 : 1;
  return `${rounded(share, digits) < 0 ? "−" : "+"}${fixed(Math.abs(share), digits)} %`;
}

// A probability, with more digits where it is nearly sure.
export function chance(probability) {
  const share = 100 * probability;
  if (share > 99.99 || share < 0.01) return share > 50 ? "over 99.99 %" : "under 0.01 %";
  const doubt = Math.min(share, 100 - share);
  return `${share.toFixed(doubt >= 1 ? 0 : doubt >= 0.1 ? 1 : 2)} %`;
}

// What the interval of an energy is wide from.
export function widthFrom(parts, titles) {
  const called = (part) =>
    part.effect === "noise" ? "noise of one drive" : `${titles[part.effect] ?? part.effect} (${part.parameter.replaceAll("_", " ")})`;
  return parts.slice(0, 3).map((part) => `${called(part)} ${(100 * part.share_of_variance).toFixed(0)} %`).join(", ");
}

export function watts(value) {
  if (value === null || value === undefined) return "";
  const size = Math.abs(value);
  return `${fixed(value, size < 0.1 ? 3 : size < 10 ? 2 : size < 100 ? 1 : 0)} W`;
}

// A bias, with its sign.
export function signedWatts(value) {
  const size = watts(Math.abs(value));
  return `${value < 0 && size !== watts(0) ? "−" : "+"}${size}`;
}

export function percent(share) {
  return share === null || share === undefined ? "" : `${fixed(100 * share, Math.abs(share) >= 0.1 ? 0 : 1)} %`;
}

// Any number with so many significant digits.
export function number(value, digits) {
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
}

// A parameter with its standard error. What is small beside the error has no digits below it.
export function estimate(value, stderr) {
  if (stderr === null) return number(value, 3);
  return `${number(rounded(value, digitsFor([value, stderr], 3)), 3)} ± ${number(stderr, 2)}`;
}
