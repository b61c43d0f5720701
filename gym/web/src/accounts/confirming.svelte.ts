/** Proof of one's identity before a way to sign in changes, and for an operator: the server demands it, `ConfirmDialog` asks for it. */

import { ApiError } from "../api/client";

/** The codes of the server's errors that demand a proof. */
const CODES = ["confirm-first", "confirm-operator"] as const;
export type Demand = (typeof CODES)[number];

let waiting: ((confirmed: boolean) => void)[] = [];
let demand = $state.raw<Demand | null>(null);

/** Why the dialog has to be shown; null: it has not. */
export const demanded = (): Demand | null => demand;

/** Ends the dialog; `confirmed`: whether the server accepted the proof. */
export function endAsking(confirmed: boolean): void {
  demand = null;
  for (const answer of waiting.splice(0)) answer(confirmed);
}

/** Ask for a proof; requests that need one at the same time share a dialog. */
function proof(why: Demand): Promise<boolean> {
  demand ??= why;
  return new Promise((resolve) => waiting.push(resolve));
}

/** Runs a change, and runs it again after the person has proved who they are, if the server demands that. */
export async function confirmed<T>(change: () => Promise<T>): Promise<T> {
  try {
    return await change();
  } catch (error) {
    const why = error instanceof ApiError ? CODES.find((code) => code === error.code) : undefined;
    if (!why || !(await proof(why))) throw error;
    return change();
  }
}
