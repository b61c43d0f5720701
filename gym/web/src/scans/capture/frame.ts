/** Measures of a small camera frame and of the phone's sensors, and the warnings that follow from them. */

export type Warning = "blur" | "dark" | "bright" | "tilt" | "motion";

/** A grey picture, values 0 to 255, row by row. */
export interface Grey {
  width: number;
  height: number;
  values: Uint8ClampedArray;
}

/** Measures of the present moment; null if the phone does not report them. */
export interface Moment {
  sharpness: number;
  luminance: number;
  /** Degrees by which the phone is turned away from upright or lengthwise. */
  roll: number | null;
  /** Degrees per second. */
  rotation: number | null;
}

/** The longer side of a measured frame in pixels: that of the server's check (`ingest/image_file.py`), so that its limits hold. */
export const FRAME_SIDE = 1024;
/** The server refuses a photo below this sharpness (`MIN_SHARPNESS`) … */
const MIN_SHARPNESS = 3;
/** … and a scan drops one below this share of the median of its photos (`ingest/selection.py`). */
const MIN_SHARPNESS_SHARE = 0.04;
/** Photos needed for a median that means something. */
const MIN_FOR_MEDIAN = 3;
/**
 * Mean luminance. A phone's exposure aims at middle grey (118 in sRGB). 50 is two and a half stops below: the exposure is at its
 * end, and photos are noisy and blurred. 215 is two stops above: holds in the light are white without detail.
 */
const MIN_LUMINANCE = 50;
const MAX_LUMINANCE = 215;
/** A 4:3 picture turned by 15° contains a level one of three quarters of its width only, so that a row of photos has gaps at its rims. */
const MAX_ROLL_DEG = 15;
/** Indoors a phone exposes for about 1/60 s: 20°/s then smear 5 of 1024 pixels at a view of 65°. */
const MAX_ROTATION_DEG_S = 20;
/** Below this length, the part of gravity in the picture's plane has no useful direction: the phone looks up or down. */
const MIN_GRAVITY = 0.35;

/** The grey values of RGBA pixels, weighted as OpenCV does. */
export function greyOf({ width, height, data }: { width: number; height: number; data: Uint8ClampedArray }): Grey {
  const values = new Uint8ClampedArray(width * height);
  for (let at = 0; at < values.length; at++) {
    values[at] = 0.299 * data[4 * at]! + 0.587 * data[4 * at + 1]! + 0.114 * data[4 * at + 2]!;
  }
  return { width, height, values };
}

/** The variance of the Laplacian, as in the server's check; without the outermost pixels. */
export function sharpnessOf({ width, height, values }: Grey): number {
  let sum = 0;
  let squares = 0;
  for (let row = 1; row < height - 1; row++) {
    for (let at = row * width + 1; at < (row + 1) * width - 1; at++) {
      const edge = values[at - 1]! + values[at + 1]! + values[at - width]! + values[at + width]! - 4 * values[at]!;
      sum += edge;
      squares += edge * edge;
    }
  }
  const count = (width - 2) * (height - 2);
  return count > 0 ? squares / count - (sum / count) ** 2 : 0;
}

export function luminanceOf({ values }: Grey): number {
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}

/**
 * How far the phone is turned from the nearest quarter turn, in degrees, by the angles of a `deviceorientation` event. Null if
 * the phone looks so far up or down that this means nothing.
 */
export function rollOf(beta: number, gamma: number): number | null {
  const [b, g] = [(beta * Math.PI) / 180, (gamma * Math.PI) / 180];
  // The upward direction along the screen's two sides: https://www.w3.org/TR/orientation-event/#worked-example
  const [right, up] = [-Math.cos(b) * Math.sin(g), Math.sin(b)];
  if (Math.hypot(right, up) < MIN_GRAVITY) return null;
  const turned = (Math.atan2(right, up) * 180) / Math.PI;
  return Math.abs(turned - 90 * Math.round(turned / 90));
}

/** The warnings of a moment; `taken`: the sharpness of the photos taken so far. */
export function warningsOf({ sharpness, luminance, roll, rotation }: Moment, taken: readonly number[]): Warning[] {
  const sorted = [...taken].sort((one, other) => one - other);
  const median = sorted.length < MIN_FOR_MEDIAN ? 0 : sorted[Math.floor(sorted.length / 2)]!;
  const found: [Warning, boolean][] = [
    ["dark", luminance < MIN_LUMINANCE],
    ["bright", luminance > MAX_LUMINANCE],
    ["motion", rotation !== null && rotation > MAX_ROTATION_DEG_S],
    ["blur", sharpness < Math.max(MIN_SHARPNESS, MIN_SHARPNESS_SHARE * median)],
    ["tilt", roll !== null && roll > MAX_ROLL_DEG],
  ];
  return found.flatMap(([warning, holds]) => (holds ? [warning] : []));
}
