/** The page from which a visitor went to sign in: signing in by any way, in this tab or by a mailed link, leads back there. */

import { navigate } from "../routes";
import { invitation } from "../session.svelte";

const KEPT = "walltopo-before-sign-in";
const KEPT_MS = 60 * 60_000;
const ACCOUNT = /^\/(sign-in|sign-up|new-password|invitation|unsubscribe|setup|embed|kiosk)(\/|$)/;

/** Remember the present page, unless it is one of signing in. */
export function rememberPage(): void {
  const { pathname, search } = location;
  if (ACCOUNT.test(pathname)) return;
  localStorage.setItem(KEPT, JSON.stringify({ page: pathname + search, at: Date.now() }));
}

/** The address to which signing in leads, forgotten from now on: an invitation, the page before, or the start. */
export function pageAfterSignIn(): string {
  const kept = JSON.parse(localStorage.getItem(KEPT) ?? "{}") as { page?: string; at?: number };
  localStorage.removeItem(KEPT);
  if (invitation.get()) return "/invitation";
  return kept.page && Date.now() - (kept.at ?? 0) < KEPT_MS ? kept.page : "/";
}

export async function leaveSignIn(): Promise<void> {
  const { pathname, search } = new URL(pageAfterSignIn(), location.origin);
  await navigate(pathname as "/", { search, replace: true });
}
