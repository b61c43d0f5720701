/** The paper of the reader's country: Letter in North America and a few other countries, else A4. */

import { browserLanguages } from "./languages";

const LETTER: readonly string[] = ["US", "CA", "MX", "PH", "CL", "CO", "CR", "GT", "PA", "PR", "SV", "VE"];

export function usesLetter(): boolean {
  const [first] = browserLanguages();
  return first !== undefined && LETTER.includes(new Intl.Locale(first).maximize().region ?? "");
}
