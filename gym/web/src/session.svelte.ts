/** Who is signed in here. The secret is a cookie that no script can read; this is only whose it is. */

import { answer, api, Problem, type Schemas } from "./api/client";
import { forgetWall } from "./wall/script";
import { forgetAnswers, isCutOff, KEPT, keeps } from "./offline/reception.svelte";

const SIGNED_IN = "walltopo-signed-in";

let person = $state.raw<Schemas["Me"] | null>(null);

export function me(): Schemas["Me"] | null {
  return person;
}

export function signedIn(as: Schemas["Me"]): void {
  // What was said before was said to somebody else.
  if (person?.id !== as.id) forget();
  person = as;
  localStorage.setItem(SIGNED_IN, "yes");
}

export function signedOut(): void {
  person = null;
  localStorage.removeItem(SIGNED_IN);
  forget();
}

function forget(): void {
  forgetWall();
  void forgetAnswers();
}

/** Who was signed in here last; visitors are not asked for. What is kept of them does for the moment. */
export async function recall(): Promise<void> {
  if (localStorage.getItem(SIGNED_IN) === null) return;
  const asked = keeps() && isCutOff() ? null : ask();
  if (keeps()) person = (await answer(api.GET("/api/v1/me", KEPT)).catch(() => null)) ?? null;
  if (!person) await (asked ?? ask());
}

async function ask(): Promise<void> {
  try {
    person = await answer(api.GET("/api/v1/me"));
  } catch (error) {
    if (error instanceof Problem && error.status === 401) signedOut();
    else if (!(error instanceof Problem)) throw error;
  }
}

const INVITATION = "walltopo-invitation";

/** An invitation that was opened before there was an account; kept over the mail that makes one. */
export const invitation = {
  keep: (secret: string): void => localStorage.setItem(INVITATION, secret),
  get: (): string | null => localStorage.getItem(INVITATION),
  drop: (): void => localStorage.removeItem(INVITATION),
};

/** The secret of a mailed link: what stands after `#`, which no server ever sees. */
export function secretOfLink(): string {
  return location.hash.slice(1);
}
