/** The language of the viewer: all walls of a page have the same. */

import { numberFormat } from "../data/numbers";
import { cs } from "./cs";
import { de } from "./de";
import { en } from "./en";
import type { Language } from "./en";
import { fr } from "./fr";

const LANGUAGES: Record<string, Language> = { en, de, cs, fr };
let spoken: Language = en;

/** The first available one of the preferred languages ("de-AT", "fr"), else English. */
export function speak(preferred: readonly string[]): Language {
  const codes = preferred.map((code) => code.toLowerCase().split("-")[0]!);
  const found = codes.find((code) => Object.hasOwn(LANGUAGES, code));
  spoken = LANGUAGES[found ?? "en"]!;
  return spoken;
}

/** The language that is spoken now. */
export const say = (): Language => spoken;

const plurals = new Map<string, Intl.PluralRules>();

/** The rule of the language; making it takes as long as a hundred uses of it. */
function plural(): Intl.PluralRules {
  const { code } = spoken;
  let rules = plurals.get(code);
  if (rules === undefined) plurals.set(code, (rules = new Intl.PluralRules(code)));
  return rules;
}

/** "3 holds", in the form that the language has for this number. */
export function counted(count: number, what: keyof Language["counted"]): string {
  const forms = spoken.counted[what];
  const kind = plural().select(count);
  const form = kind === "one" || kind === "few" ? (forms[kind] ?? forms.other) : forms.other;
  return `${count} ${form}`;
}

/** A sentence with numbers put into its braces: one each, or all into the only one. */
export function filled(sentence: string, numbers: readonly number[]): string {
  const places = sentence.split("{}");
  if (places.length === 2) return places.join(numbers.join(", "));
  return places.reduce((text, place, k) => text + String(numbers[k - 1] ?? "") + place);
}

/** "1 March 2026", as the reader's country writes it. */
export function day(iso: string): string {
  const own = navigator.languages.find((code) => code.toLowerCase().split("-")[0] === spoken.code);
  // A day has no time zone: as midnight in one and written in another it may be the day before.
  return new Date(iso).toLocaleDateString(own ?? spoken.code, { dateStyle: "long", timeZone: "UTC" });
}

/** A number with `digits` decimals as the language writes it. */
export function decimal(value: number, digits: number): string {
  return numberFormat(spoken.code, { minimumFractionDigits: digits, maximumFractionDigits: digits, useGrouping: false }).format(value);
}
