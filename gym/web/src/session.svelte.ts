/** The signed-in person. The secret is a cookie that no script can read; this only says whose it is. */

import { answer, api, ApiError, type Schemas } from "./api/client";
import { forgetBody } from "./walls/body.svelte";
import { forgetWall } from "./walls/script";
import { forgetPrivate, isCutOff, KEPT, keeps, returned } from "./offline/reception.svelte";

const SIGNED_IN = "walltopo-signed-in";

let person = $state.raw<Schemas["Me"] | null>(null);

export function me(): Schemas["Me"] | null {
  return person;
}

export function signedIn(as: Schemas["Me"]): void {
  // Stored data belongs to the earlier account.
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
  forgetBody();
  forgetWall();
  void forgetPrivate();
}

/** The last signed-in person; visitors are not looked up. Stored data is enough until the server responds. */
export async function recall(): Promise<void> {
  if (localStorage.getItem(SIGNED_IN) === null) return;
  let responded = false;
  const requested = keeps() && isCutOff() ? null : ask().then((known) => (responded = known));
  if (keeps()) {
    const kept = await answer(api.GET("/api/v1/me", KEPT)).catch(() => null);
    if (!responded) person = kept ?? null; // a slow store must not undo a sign-out
  }
  if (!person && !responded) await (requested ?? ask());
}

/** Ask the server for the signed-in person; returns whether it responded. */
async function ask(): Promise<boolean> {
  try {
    person = await answer(api.GET("/api/v1/me"));
    return true;
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    if (error.status === 401) signedOut();
    return error.status === 401;
  }
}

/** Ask again when the server is reachable again: until then the answer may have been an earlier one that was stored. */
export function followReception(): void {
  $effect.root(() => {
    $effect(() => {
      if (returned() > 0 && localStorage.getItem(SIGNED_IN) !== null) void ask();
    });
  });
}

const INVITATION = "walltopo-invitation";

/** An invitation that was opened before sign-up; stored until the mailed link returns. */
export const invitation = {
  keep: (secret: string): void => localStorage.setItem(INVITATION, secret),
  get: (): string | null => localStorage.getItem(INVITATION),
  drop: (): void => localStorage.removeItem(INVITATION),
};

/** The secret of a mailed link: the part after `#`, which no server ever sees. */
export function secretOfLink(): string {
  return location.hash.slice(1);
}
