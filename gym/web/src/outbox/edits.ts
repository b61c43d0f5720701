/** Which edit of this browser something is: the server lets a late copy of an older one change nothing. */

import { createStore, update, type UseStore } from "idb-keyval";

export interface Edit {
  /** Of this browser, made here; it says nothing of who uses it. */
  device: string;
  /** Grows with every edit, whatever the clock does. */
  number: number;
  /** When it was made by this browser's clock, ms: only how long ago that is leaves it. */
  at: number;
}

let store: UseStore | undefined;

function kept(): UseStore {
  return (store ??= createStore("walltopo-device", "kept"));
}

/** The next one; tabs that ask at the same moment get different ones. */
export async function nextEdit(): Promise<Edit> {
  let next: Edit | undefined;
  await update<Edit>("edit", (last) => {
    const device = last?.device ?? crypto.randomUUID();
    return (next = { device, number: (last?.number ?? 0) + 1, at: Date.now() });
  }, kept());
  return next!;
}

/** As the server reads it. */
export function told({ device, number, at }: Edit): { device: string; number: number; age_s: number } {
  return { device, number, age_s: Math.max(0, (Date.now() - at) / 1000) };
}
