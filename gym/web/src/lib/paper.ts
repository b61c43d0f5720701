/** Paper and units of the reader's country, for a new gym: its settings decide later. */

import { browserLanguages } from "./languages";

const LETTER: readonly string[] = ["US", "CA", "MX", "PH", "CL", "CO", "CR", "GT", "PA", "PR", "SV", "VE"];

const IMPERIAL: readonly string[] = ["US", "LR", "MM"];

export function usesLetter(): boolean {
  return LETTER.includes(region());
}

export function usesImperial(): boolean {
  return IMPERIAL.includes(region());
}

function region(): string {
  const [first] = browserLanguages();
  return first === undefined ? "" : (new Intl.Locale(first).maximize().region ?? "");
}
