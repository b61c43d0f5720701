/** Slab, vertical, overhang: the rule of `walltopo.scans.holds`; a test holds them together. */

export type Lean = "slab" | "vertical" | "overhang";

const VERTICAL_DEG = 5; // whole degrees from upright that still are vertical
export const STEEP_DEG = 35; // whole degrees from which an overhang is steep

/** Degrees as they are written: whole. */
export const whole = (degrees: number): number => Math.round(degrees) || 0;

/** Positive degrees lean towards the climber. */
export function lean(degrees: number): Lean {
  if (Math.abs(whole(degrees)) <= VERTICAL_DEG) return "vertical";
  return degrees > 0 ? "overhang" : "slab";
}
