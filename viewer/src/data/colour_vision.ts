/** Patterns for colours that look alike to some people, as `viewer/colour_vision.py` found them; the platform's app has them too. */

import table from "./colour_vision.json";

export type Vision = keyof typeof table;

interface Seen {
  /** Differs from the patterns of the colours that look alike; 0: plain. */
  pattern: number;
  ink: string;
  alike: string[];
}

const PATTERNS: ((ink: string) => string)[] = [
  () => "",
  (ink) => `repeating-linear-gradient(45deg, ${ink} 0 2px, transparent 2px 5px), `,
  (ink) => `radial-gradient(circle, ${ink} 34%, transparent 40%), `,
  (ink) =>
    ["90deg", "0deg"].map((turn) => `linear-gradient(${turn}, transparent 40%, ${ink} 40% 60%, transparent 60%), `).join(""),
  (ink) => `radial-gradient(circle, transparent 28%, ${ink} 34% 50%, transparent 56%), `,
];

export const VISIONS = Object.keys(table) as Vision[];

export function isVision(name: string | null): name is Vision {
  return name !== null && name in table;
}

function seen(colour: string | null, vision: Vision | null): Seen | undefined {
  return vision === null ? undefined : (table[vision] as Record<string, Seen>)[colour ?? ""];
}

/** Layers of a CSS background over a colour, with the comma before it; empty where the colour is plain. */
export function patternOver(colour: string | null, vision: Vision | null): string {
  const found = seen(colour, vision);
  return found ? PATTERNS[found.pattern]!(found.ink) : "";
}

/** Whether a colour looks like one of the others. */
export function looksLike(colour: string | null, others: ReadonlySet<string | null>, vision: Vision | null): boolean {
  return seen(colour, vision)?.alike.some((other) => others.has(other)) ?? false;
}
