/** The common grade scales; the server refuses unknown labels (`gyms/service.py`). */

export const FONT = ("3 4 4+ 5 5+ 6A 6A+ 6B 6B+ 6C 6C+ 7A 7A+ 7B 7B+ 7C 7C+ 8A 8A+ 8B 8B+ 8C 8C+ 9A").split(" ");
export const V_SCALE = ["VB", ...Array.from({ length: 18 }, (_, number) => `V${number}`)];

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
