/** The paper of the reader's country: Letter in North America and a few other countries, else A4. */

const LETTER: readonly string[] = ["US", "CA", "MX", "PH", "CL", "CO", "CR", "GT", "PA", "PR", "SV", "VE"];

export function usesLetter(): boolean {
  return LETTER.includes(new Intl.Locale(navigator.language).maximize().region ?? "");
}
