/** The reader's colour vision, kept in this browser: colours that look alike get patterns. The viewer keeps it under the same name. */

import type { Vision } from "../../../../viewer/src/data/colour_vision";

export type { Vision };
export const VISIONS = ["protan", "deutan", "tritan", "none"] as const satisfies Vision[];

const KEPT = "walltopo-colour-vision";
const isVision = (name: string | null): name is Vision => VISIONS.some((each) => each === name);

let chosen = $state<Vision | null>(null);
// Loaded for those who need it.
let over = $state.raw<(colour: string) => string>(() => "");

/** Null: usual. */
export function vision(): Vision | null {
  return chosen;
}

/** Layers of a CSS background over a colour, with the comma before it; empty where the colour is plain. */
export function patternOver(colour: string): string {
  return over(colour);
}

export async function see(next: Vision | null): Promise<void> {
  if (next) localStorage.setItem(KEPT, next);
  else localStorage.removeItem(KEPT);
  await use(next);
}

async function use(next: Vision | null): Promise<void> {
  const patterns = next && (await import("../../../../viewer/src/data/colour_vision"));
  chosen = next;
  over = patterns ? (colour) => patterns.patternOver(colour, next) : () => "";
}

const kept = localStorage.getItem(KEPT);
if (isVision(kept)) void use(kept);
