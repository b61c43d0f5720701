/** A climber's height and arm span: of the profile, or as entered on this phone, which they never leave. */

import { answer, api } from "../api/client";
import { me } from "../session.svelte";

const KEPT = "walltopo-body";

export interface Body {
  height_cm: number | null;
  reach_cm: number | null;
}

function keptBody(): Body {
  const body = JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Partial<Body>;
  return { height_cm: body.height_cm ?? null, reach_cm: body.reach_cm ?? null };
}

export const body = $state<Body & { isInProfile: boolean }>({ ...keptBody(), isInProfile: false });

/** Take the profile's numbers if it has any. Without reception the phone's own are enough. */
export async function loadBody(): Promise<void> {
  const profile = me() ? await answer(api.GET("/api/v1/me/profile")).catch(() => null) : null;
  if (profile?.height_cm != null) Object.assign(body, { height_cm: profile.height_cm, reach_cm: profile.reach_cm ?? null, isInProfile: true });
}

export function enterBody(item: keyof Body, value: number | null): void {
  body[item] = value;
  localStorage.setItem(KEPT, JSON.stringify({ height_cm: body.height_cm, reach_cm: body.reach_cm }));
}

/** When a person signs out. */
export function forgetBody(): void {
  localStorage.removeItem(KEPT);
  Object.assign(body, { height_cm: null, reach_cm: null, isInProfile: false });
}
