/** Hints for the next photo, from the server's overlap of photos; no hint for unknown overlaps. */

import type { Schemas } from "../../api/client";

type Photo = Pick<Schemas["PhotoOut"], "id" | "plate_frames">;
type Facts = Schemas["OverlapOut"];

export type Hint = { name: "apart" | "stepLeft" | "stepRight" | "higher" } | { name: "plate"; count: number } | { name: "plateUnseen" };

/** Photos that should show the scale plate (docs/capture.md). */
const PLATE_PHOTOS = 3;
/** Neighbours should share two thirds of their width; below half, a spot of the wall is in two photos only. */
const MAX_STEP = 0.5;
/** From so many photos on, a single row is worth a word … */
const ROW_PHOTOS = 6;
/** … if the views differ in height by less than this share of a picture. */
const ROW_HEIGHT = 0.25;

/** The hints for the next photo; `photos`: the usable ones in the order of capture. */
export function hintsOf(photos: readonly Photo[], facts: Facts | null, registered: boolean): Hint[] {
  const place = facts && !facts.pending && facts.groups.length > 0 ? placeHints(photos, facts) : [];
  return [...place, ...(registered ? [] : plateHints(photos))];
}

function placeHints(photos: readonly Photo[], facts: Facts): Hint[] {
  const [before, last] = photos.slice(-2);
  const main = facts.groups[0]!;
  // Photos that came after the answer are not in it.
  if (!before || !last || !photos.every(({ id }) => facts.groups.some((group) => group.includes(id)))) return [];
  if (!main.includes(last.id)) return [{ name: "apart" }];
  const step = facts.shifts.find((shift) => shift.before === before.id && shift.after === last.id);
  if (step && Math.abs(step.right) > MAX_STEP) return [{ name: step.right > 0 ? "stepLeft" : "stepRight" }];
  return main.length >= ROW_PHOTOS && heightOf(main, facts.shifts) < ROW_HEIGHT ? [{ name: "higher" }] : [];
}

/** By how much the views of a group differ in height, in pictures; the shifts connect all of its photos. */
function heightOf(group: readonly string[], shifts: Facts["shifts"]): number {
  const heights = new Map([[group[0]!, 0]]);
  // A map that grows while it is read: each photo is visited once.
  for (const [photo, height] of heights) {
    for (const { before, after, up } of shifts) {
      if (before === photo && !heights.has(after)) heights.set(after, height + up);
      if (after === photo && !heights.has(before)) heights.set(before, height - up);
    }
  }
  return Math.max(...heights.values()) - Math.min(...heights.values());
}

function plateHints(photos: readonly Photo[]): Hint[] {
  const count = photos.reduce((sum, { plate_frames }) => sum + plate_frames, 0);
  if (photos.length === 0 || count >= PLATE_PHOTOS) return [];
  return [count === 0 ? { name: "plateUnseen" } : { name: "plate", count }];
}
