// Axes of charts: round numbers, and as much room as they need.

import { fixed } from "./words.js";

const pen = document.createElement("canvas").getContext("2d");

// Pixels that words are wide in a chart, see .chart in page.css.
export function widthOf(words) {
  pen.font = "11px system-ui, sans-serif";
  return pen.measureText(words).width;
}

// Words cut off where the room ends.
export function fitted(words, room) {
  let kept = words;
  while (kept && widthOf(kept === words ? kept : `${kept}…`) > room) kept = kept.slice(0, -1);
  return kept === words ? words : kept && `${kept.trimEnd()}…`;
}

const STEPS = [5, 2, 1];

// At least so many round numbers from low to high, as few as can be, each with the digits of their
// step: what is less than these is not seen in the chart either.
export function ticks(low, high, least = 3) {
  if (!(high > low)) return [{ value: low, words: fixed(low, 0) }];
  for (let power = Math.floor(Math.log10(high - low)); ; power--) {
    for (const times of STEPS) {
      const step = times * 10 ** power;
      const [first, last] = [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
      if (last - first + 1 < least) continue;
      return Array.from({ length: last - first + 1 }, (_, k) => {
        const value = (first + k) * step;
        return { value, words: fixed(value, Math.max(0, -power)) };
      });
    }
  }
}

// Of numbers in a row those that keep clear of each other; x gives the place of a value.
export function clear(numbers, x) {
  let end = -Infinity;
  return numbers.filter(({ value, words }) => {
    const half = widthOf(words) / 2;
    if (x(value) - half < end + 6) return false;
    end = x(value) + half;
    return true;
  });
}

// Pixels on the left of a chart for the numbers of its upright axis.
export const roomFor = (numbers) => Math.ceil(Math.max(...numbers.map(({ words }) => widthOf(words)))) + 6;

// Draw a chart as wide as it is on the page, so that its words keep their size; and again with
// every other width.
const charts = new WeakMap();
const watcher = new ResizeObserver((entries) => {
  for (const { target } of entries) redraw(target);
});

function redraw(chart) {
  const known = charts.get(chart);
  const width = Math.round(chart.clientWidth || chart.getBoundingClientRect().width);
  if (!width || width === known.width) return;
  known.width = width;
  known.draw(width);
}

export function drawToWidth(chart, draw) {
  charts.set(chart, { draw, width: 0 });
  watcher.observe(chart);
  redraw(chart);
}
