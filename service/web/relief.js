// Heights as a shaded picture, lit from the north-west, and the frame that maps metres to pixels.

const TINTS = [[176, 190, 165], [208, 206, 176], [206, 188, 158], [222, 212, 202]];
const OBSTACLE = [64, 70, 84];
const UNKNOWN = [236, 236, 238];

function tint(share) {
  const place = share * (TINTS.length - 1);
  const k = Math.min(Math.floor(place), TINTS.length - 2);
  return TINTS[k].map((v, c) => v + (TINTS[k + 1][c] - v) * (place - k));
}

// Steepness that shows as 45 degrees: that of the steepest twentieth, but no more than 25-fold.
function exaggeration(slopes) {
  const sorted = slopes.filter(Number.isFinite).sort((a, b) => a - b);
  const steep = sorted[Math.floor(0.95 * sorted.length)] ?? 0;
  return Math.min(1 / Math.max(steep, 1e-3), 25);
}

export function drawRelief(canvas, relief) {
  const { columns, rows, heights, blocked, cell } = relief;
  const at = (j, i) => heights[Math.min(Math.max(j, 0), rows - 1) * columns + Math.min(Math.max(i, 0), columns - 1)];
  const known = heights.filter((h) => h !== null);
  const low = known.reduce((a, b) => Math.min(a, b), Infinity);
  const high = known.reduce((a, b) => Math.max(a, b), -Infinity);
  const east = new Float64Array(rows * columns);
  const north = new Float64Array(rows * columns);
  for (let j = 0; j < rows; j++) {
    for (let i = 0; i < columns; i++) {
      const here = at(j, i);
      const or = (value) => value ?? here;
      east[j * columns + i] = (or(at(j, i + 1)) - or(at(j, i - 1))) / (2 * cell[0]);
      north[j * columns + i] = (or(at(j + 1, i)) - or(at(j - 1, i))) / (2 * cell[1]);
    }
  }
  const factor = exaggeration(Array.from(east, (e, k) => Math.hypot(e, north[k])));
  const image = new ImageData(columns, rows);
  for (let j = 0; j < rows; j++) {
    for (let i = 0; i < columns; i++) {
      const k = j * columns + i;
      let colour = UNKNOWN;
      if (blocked[k]) colour = OBSTACLE;
      else if (heights[k] !== null) {
        const [e, n] = [factor * east[k], factor * north[k]];
        const lit = Math.max(0, (0.5 * e - 0.5 * n + Math.SQRT1_2) / Math.sqrt(1 + e * e + n * n));
        const share = high - low > 1e-9 ? (heights[k] - low) / (high - low) : 0.35;
        colour = tint(share).map((v) => v * (0.62 + 0.55 * Math.min(lit, 1)));
      }
      image.data.set([...colour, 255], 4 * ((rows - 1 - j) * columns + i));
    }
  }
  canvas.width = columns;
  canvas.height = rows;
  canvas.getContext("2d").putImageData(image, 0, 0);
}

// Metres of the map's frame to pixels of a drawing as wide as WIDTH, and back.
export function frameOf(relief) {
  const width = 1000;
  const [x0, y0, x1, y1] = relief.extent;
  const scale = width / (x1 - x0);
  return {
    width,
    height: (y1 - y0) * scale,
    toPixel: (x, y) => [(x - x0) * scale, (y1 - y) * scale],
    toMetres: (px, py) => [x0 + px / scale, y1 - py / scale],
    digits: Math.max(0, Math.min(3, Math.ceil(-Math.log10((x1 - x0) / 2000)))),
  };
}
