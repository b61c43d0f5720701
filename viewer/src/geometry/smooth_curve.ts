/** A hold's border as a smooth closed curve in space. Unit-free: sizes follow the loop's own edges. */

const SPREAD = 2.2; // edges over which a border is evened out
const MAX_SPREAD = 0.05; // of the loop's length, so that a small hold keeps its shape
const MAX_SAMPLES = 400;

/** Places and outward directions at even steps along the curve, three numbers each. */
export interface Curve {
  places: Float64Array;
  outward: Float64Array;
}

/** Values at even steps along a closed line, by linear interpolation. */
function resample(values: Float64Array, along: Float64Array, length: number, count: number): Float64Array {
  const found = new Float64Array(3 * count);
  const corners = along.length;
  let k = 0;
  for (let step = 0; step < count; step++) {
    const at = (step / count) * length;
    while (k + 1 < corners && along[k + 1]! <= at) k++;
    const next = (k + 1) % corners;
    const end = next === 0 ? length : along[next]!;
    const share = (at - along[k]!) / Math.max(end - along[k]!, 1e-12);
    for (let axis = 0; axis < 3; axis++) {
      const from = values[3 * k + axis]!;
      found[3 * step + axis] = from + share * (values[3 * next + axis]! - from);
    }
  }
  return found;
}

function blur(values: Float64Array, sigma: number): Float64Array {
  const count = values.length / 3;
  const reach = Math.min(Math.ceil(3 * sigma), count >> 1);
  const weights = Array.from({ length: reach + 1 }, (_, d) => Math.exp((-d * d) / (2 * sigma * sigma)));
  const total = weights.reduce((sum, weight, d) => sum + (d ? 2 : 1) * weight, 0);
  const found = new Float64Array(values.length);
  for (let k = 0; k < count; k++) {
    for (let d = -reach; d <= reach; d++) {
      const from = (k + d + count) % count;
      const weight = weights[Math.abs(d)]! / total;
      for (let axis = 0; axis < 3; axis++) found[3 * k + axis]! += weight * values[3 * from + axis]!;
    }
  }
  return found;
}

export function loopLength(places: Float64Array): number {
  let sum = 0;
  for (let k = 0, before = places.length - 3; k < places.length; before = k, k += 3) {
    sum += Math.hypot(places[k]! - places[before]!, places[k + 1]! - places[before + 1]!, places[k + 2]! - places[before + 2]!);
  }
  return sum;
}

/** The smooth curve of a loop of border vertices with their outward directions. */
export function smoothCurve(places: Float64Array, outward: Float64Array): Curve {
  const corners = places.length / 3;
  const along = new Float64Array(corners);
  for (let k = 1; k < corners; k++) {
    const [a, b] = [3 * k - 3, 3 * k];
    along[k] =
      along[k - 1]! + Math.hypot(places[b]! - places[a]!, places[b + 1]! - places[a + 1]!, places[b + 2]! - places[a + 2]!);
  }
  const length = loopLength(places);
  const count = Math.min(MAX_SAMPLES, Math.max(24, 2 * corners));
  const even = resample(places, along, length, count);
  const sigma = Math.max(1, Math.min((SPREAD * count) / corners, MAX_SPREAD * count));
  const once = blur(even, sigma);
  const twice = blur(once, sigma);
  // Twice the smooth one less the smoother one: a plain blur would shrink what is round.
  for (let k = 0; k < once.length; k++) once[k] = 2 * once[k]! - twice[k]!;
  return { places: once, outward: blur(resample(outward, along, length, count), sigma) };
}

/** How far inside the curves a place lies; negative outside. */
export function inside(curves: Curve[], x: number, y: number, z: number): number {
  let least = Infinity;
  let found = 0;
  for (const { places, outward } of curves) {
    for (let k = 0; k < places.length; k += 3) {
      const [dx, dy, dz] = [x - places[k]!, y - places[k + 1]!, z - places[k + 2]!];
      const square = dx * dx + dy * dy + dz * dz;
      if (square >= least) continue;
      least = square;
      found = dx * outward[k]! + dy * outward[k + 1]! + dz * outward[k + 2]!;
    }
  }
  // Samples are steps apart: across the curve is what counts, not to the nearest of them.
  return -found;
}
