/** Proof of one's identity before a way to sign in changes: the server demands it, `ConfirmDialog` asks for it. */

import { ApiError } from "../api/client";

let answered = $state.raw<((confirmed: boolean) => void) | null>(null);

/** Whether the dialog has to be shown. */
export const isAsking = (): boolean => answered !== null;

/** Ends the dialog; `confirmed`: whether the server accepted the proof. */
export function endAsking(confirmed: boolean): void {
  answered?.(confirmed);
  answered = null;
}

/** Runs a change, and runs it again after the person has proved who they are, if the server demands that. */
export async function confirmed<T>(change: () => Promise<T>): Promise<T> {
  try {
    return await change();
  } catch (error) {
    if (!(error instanceof ApiError) || error.code !== "confirm-first") throw error;
    if (!(await new Promise<boolean>((resolve) => (answered = resolve)))) throw error;
    return change();
  }
}
