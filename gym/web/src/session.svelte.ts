/** The signed-in person. The secret is a cookie that no script can read; this only says whose it is. */

import { answer, api, ApiError, whenUnsigned, type Schemas } from "./api/client";
import { forgetBody } from "./walls/body.svelte";
import { forgetWall } from "./walls/script";
import { forgetPrivate, isCutOff, KEPT, keeps, returned } from "./offline/reception.svelte";

const SIGNED_IN = "walltopo-signed-in";

let person = $state.raw<Schemas["Me"] | null>(null);
/** Number of the server's answers so far to the question who is signed in. */
let answers = 0;
let asks = false;

export function me(): Schemas["Me"] | null {
  return person;
}

export function signedIn(as: Schemas["Me"]): void {
  // Stored data belongs to the earlier account.
  if (person?.id !== as.id) forget();
  person = as;
  localStorage.setItem(SIGNED_IN, "yes");
}

/** Another server signed somebody in; `recall` asks for the person. */
export function signedInElsewhere(): void {
  forget(); // stored data belongs to the earlier account
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
  const requested = keeps() && isCutOff() ? null : ask();
  if (keeps()) {
    const kept = await answer(api.GET("/api/v1/me", KEPT)).catch(() => null);
    if (answers === 0) person = kept ?? null; // a slow store must not undo a sign-out
  }
  if (!person && answers === 0) await (requested ?? ask());
}

/** Ask the server for the signed-in person. */
async function ask(): Promise<void> {
  if (asks) return;
  asks = true;
  try {
    const found = await answer(api.GET("/api/v1/me"));
    answers += 1;
    person = found;
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    if (error.status !== 401) return;
    answers += 1;
    signedOut();
  } finally {
    asks = false;
  }
}

// The person may be an earlier answer, kept while the server was slow, of a session that was ended elsewhere.
whenUnsigned(() => {
  if (person) void ask();
});

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
