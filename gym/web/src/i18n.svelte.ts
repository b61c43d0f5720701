/** The app's words in the reader's language, by i18next. One language is loaded at a time. */

import i18next from "i18next";
import type competitions from "./competitions/locales/en.json";
import type hall from "./hall/locales/en.json";
import type insights from "./insights/locales/en.json";
import type en from "./locales/en.json";

export const LANGUAGES = { en: "English", de: "Deutsch", cs: "Čeština", fr: "Français" } as const;
export type Language = keyof typeof LANGUAGES;

type Forms<K extends string> = K extends `${infer Base}_${"one" | "few" | "many" | "other"}` ? Base : K;
type Paths<T, Before extends string = ""> = {
  [K in keyof T & string]: T[K] extends string ? `${Before}${Forms<K>}` : Paths<T[K], `${Before}${K}.`>;
}[keyof T & string];
/** Where a text stands in `locales/en.json`, or in that of an area (`addWords`); plural forms without their ending. */
export type Key = Paths<typeof en & typeof competitions & typeof hall & typeof insights>;

const KEPT = "walltopo-language";
type Loaders = Record<string, () => Promise<object>>;
const LOADERS: Loaders[] = [import.meta.glob<object>("./locales/*.json", { import: "default" })];

// English are the server's own words.
const SAID = import.meta.glob<Record<string, string>>("./said/*.json", { import: "default" });
let saidHere: Record<string, string> = {};
let spoken = $state<Language>("en");

/** A text; whoever shows it is drawn again when the language changes. */
export function t(key: Key, values: Record<string, unknown> = {}): string {
  return i18next.t(key as string, { lng: spoken, ...values });
}

/** What the server says, by its code, in the reader's language; null where there are no words for it. */
export function said(code: string, values: Record<string, string>): string | null {
  const text = saidHere[code];
  return text === undefined ? null : text.replace(/\{(\w+)\}/g, (whole, name: string) => values[name] ?? whole);
}

export function language(): Language {
  return spoken;
}

function isKnown(code: string): code is Language {
  return code in LANGUAGES;
}

/** The language that was chosen here, else the first of the browser's that there is. */
function wished(): Language {
  const asked = [localStorage.getItem(KEPT) ?? "", ...navigator.languages];
  return asked.map((code) => code.slice(0, 2)).find(isKnown) ?? "en";
}

async function learn(code: Language, loaders: Loaders): Promise<void> {
  i18next.addResourceBundle(code, "translation", await loaders[`./locales/${code}.json`]!(), true);
}

/**
 * The words of an area of the app, which come with its pages: each of those imports a `words.ts` that waits for this.
 * The area's first key is its own.
 */
export async function addWords(loaders: Loaders): Promise<void> {
  LOADERS.push(loaders);
  await begun;
  await learn(spoken, loaders);
}

export async function speak(code: Language, keep = true): Promise<void> {
  saidHere = (await SAID[`./said/${code}.json`]?.()) ?? {};
  await Promise.all(LOADERS.map((loaders) => learn(code, loaders)));
  spoken = code;
  document.documentElement.lang = code;
  if (keep) localStorage.setItem(KEPT, code);
}

let begun: Promise<void> | undefined;

export function begin(): Promise<void> {
  return (begun ??= start());
}

async function start(): Promise<void> {
  await i18next.init({
    fallbackLng: false,
    resources: {},
    showSupportNotice: false,
    // Svelte escapes what it shows.
    interpolation: { escapeValue: false },
  });
  await speak(wished(), false);
}

const DAY = { dateStyle: "medium" } as const;

/** A day as the reader writes it; `text` is a date or a moment, ISO 8601. */
export function day(text: string): string {
  // A date without a time is that day everywhere.
  const zone = text.length === 10 ? { timeZone: "UTC" } : {};
  return new Intl.DateTimeFormat(spoken, { ...DAY, ...zone }).format(new Date(text));
}

export function moment(text: string): string {
  return new Intl.DateTimeFormat(spoken, { ...DAY, timeStyle: "short" }).format(new Date(text));
}

/** A moment as short as it can be told: the hour today, else the day too. */
export function time(at: Date): string {
  const isToday = at.toDateString() === new Date().toDateString();
  return new Intl.DateTimeFormat(spoken, isToday ? { timeStyle: "short" } : { ...DAY, timeStyle: "short" }).format(at);
}
