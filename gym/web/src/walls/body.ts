/** Height and reach as entered on this phone, for people whose profile has none. They leave it never. */

const KEPT = "walltopo-body";

export interface Body {
  height_cm: number | null;
  reach_cm: number | null;
}

export function keptBody(): Body {
  const body = JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Partial<Body>;
  return { height_cm: body.height_cm ?? null, reach_cm: body.reach_cm ?? null };
}

export function keepBody(body: Body): void {
  localStorage.setItem(KEPT, JSON.stringify(body));
}

export function forgetBody(): void {
  localStorage.removeItem(KEPT);
}
