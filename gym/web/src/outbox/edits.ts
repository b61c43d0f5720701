/** The number of an edit of this browser: the server ignores late copies of older edits. */

import { createStore, update, type UseStore } from "idb-keyval";

export interface Edit {
  /** A random id of this browser; it does not reveal its user. */
  device: string;
  /** Grows with every edit, whatever the clock does. */
  number: number;
  /** Time of the edit by this browser's clock, ms; only its age is sent. */
  at: number;
}

let store: UseStore | undefined;

function kept(): UseStore {
  return (store ??= createStore("walltopo-device", "kept"));
}

/** The next number; simultaneous tabs get different ones. */
export async function nextEdit(): Promise<Edit> {
  let next: Edit | undefined;
  await update<Edit>("edit", (last) => {
    const device = last?.device ?? crypto.randomUUID();
    return (next = { device, number: (last?.number ?? 0) + 1, at: Date.now() });
  }, kept());
  return next!;
}

/** The edit as the API takes it: with its age instead of a moment. */
export function result({ device, number, at }: Edit): { device: string; number: number; age_s: number } {
  return { device, number, age_s: Math.max(0, (Date.now() - at) / 1000) };
}
