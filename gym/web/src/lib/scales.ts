/** The common grade scales; the server refuses unknown labels (`gyms/grade_labels.py`). */

export const FONT = ("3 4 4+ 5 5+ 6A 6A+ 6B 6B+ 6C 6C+ 7A 7A+ 7B 7B+ 7C 7C+ 8A 8A+ 8B 8B+ 8C 8C+ 9A").split(" ");
export const V_SCALE = ["VB", ...Array.from({ length: 18 }, (_, number) => `V${number}`)];
const FRENCH = ("3 4a 4b 4c 5a 5b 5c 6a 6a+ 6b 6b+ 6c 6c+ 7a 7a+ 7b 7b+ 7c 7c+ 8a 8a+ 8b 8b+ 8c 8c+ 9a 9a+ 9b 9b+ 9c").split(" ");
const UIAA = ("I II III IV V- V V+ VI- VI VI+ VII- VII VII+ VIII- VIII VIII+ IX- IX IX+ X- X X+ XI- XI XI+ XII- XII XII+").split(" ");

/** The usual grades of each scale; owners may take others, such as 5A to 5C and 6A+/6B. */
export const USUAL = { font: FONT, v: V_SCALE, french: FRENCH, uiaa: UIAA } as const;

export interface Grade {
  label: string;
  colour?: string | null;
  low?: string | null;
  high?: string | null;
}

/** Initial circuits of a gym: colours from easy to hard, to be changed. */
export const CIRCUITS: Grade[] = [
  { label: "Yellow", colour: "#f5c819", low: "3", high: "5" },
  { label: "Green", colour: "#289141", low: "5", high: "6A" },
  { label: "Blue", colour: "#1e55b9", low: "6A", high: "6B+" },
  { label: "Red", colour: "#c32026", low: "6B+", high: "7A" },
  { label: "Black", colour: "#262628", low: "7A", high: "8A" },
];

const OF_ROPES: readonly string[] = ["french", "uiaa"];

/** Grade systems with those first that fit a route on a line, or a boulder (`line` is empty). */
export function fitting<S extends { kind: string }>(systems: S[], line: string): S[] {
  const misfits = ({ kind }: S): number => Number(kind === "font" || kind === "v" ? line !== "" : OF_ROPES.includes(kind) && line === "");
  return systems.toSorted((a, b) => misfits(a) - misfits(b));
}
