import type { Schemas } from "../api/client";

/** Return the scores (AP50 of masks), of 100, of the shipped detector and of a gym's own network. */
export function scores(result: Schemas["NetworkResult"]): { before: number; after: number } {
  return { before: Math.round(100 * result.before.masks), after: Math.round(100 * result.after.masks) };
}
