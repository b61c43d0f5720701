/** The app's texts in the reader's language, by i18next. One language is loaded at a time. */

import i18next from "i18next";
import { browserLanguages } from "./lib/languages";
import type accounts from "./accounts/locales/en.json";
import type apps from "./apps/locales/en.json";
import type climbingLog from "./climbingLog/locales/en.json";
import type clips from "./clips/locales/en.json";
import type competitions from "./competitions/locales/en.json";
import type competitionSetup from "./competitionSetup/locales/en.json";
import type hall from "./hall/locales/en.json";
import type insights from "./insights/locales/en.json";
import type inspections from "./inspections/locales/en.json";
import type en from "./locales/en.json";
import type listening from "./listening/locales/en.json";
import type lists from "./lists/locales/en.json";
import type notifications from "./notifications/locales/en.json";
import type operator from "./operator/locales/en.json";
import type problems from "./problems/locales/en.json";
import type resets from "./resets/locales/en.json";
import type ropes from "./ropes/locales/en.json";
import type scans from "./scans/locales/en.json";
import type webhooks from "./webhooks/locales/en.json";

export const LANGUAGES = { en: "English", de: "Deutsch", cs: "Čeština", fr: "Français" } as const;
export type Language = keyof typeof LANGUAGES;

type Forms<K extends string> = K extends `${infer Base}_${"one" | "few" | "many" | "other"}` ? Base : K;
type Paths<T, Before extends string = ""> = {
  [K in keyof T & string]: T[K] extends string ? `${Before}${Forms<K>}` : Paths<T[K], `${Before}${K}.`>;
}[keyof T & string];
/** The key of a text in `locales/en.json`, or in that of an area (`withTexts`); without plural endings. */
export type Key = Paths<typeof en & typeof accounts & typeof apps & typeof climbingLog & typeof clips & typeof competitions & typeof competitionSetup & typeof hall & typeof insights & typeof inspections & typeof listening & typeof lists & typeof notifications & typeof operator & typeof problems & typeof resets & typeof ropes & typeof scans & typeof webhooks>;

/** A part of the app with texts of its own, which only its pages load (`routes.ts`). */
export type Area = "accounts" | "apps" | "climbingLog" | "clips" | "competitions" | "competitionSetup" | "hall" | "insights" | "inspections" | "listening" | "lists" | "notifications" | "operator" | "problems" | "resets" | "ropes" | "scans" | "webhooks";

const KEPT = "walltopo-language";
const TEXTS = import.meta.glob<object>(["./locales/*.json", "./*/locales/*.json"], { import: "default" });
const learned = new Set<Area | "">([""]);

// The server answers in English itself.
const PROBLEMS = import.meta.glob<object>("../../src/walltopo_gym/messages/{de,cs,fr}.json", { import: "default" });
/** A value that is written from right to left keeps to its place in a sentence: Unicode isolates it. */
const RIGHT_TO_LEFT = /[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc]/;
const isolated = (value: string): string => (RIGHT_TO_LEFT.test(value) ? `\u2068${value}\u2069` : value);
// Svelte escapes what it shows.
const VALUES = { escapeValue: true, escape: isolated };
const PLACES = { prefix: "{", suffix: "}", ...VALUES };
let spoken = $state<Language>("en");
// The languages whose sentences of server errors are here; they come after the page.
let explained = $state.raw<Language[]>([]);
let explaining: Promise<void> = Promise.resolve();

/** A text; components that show it are redrawn when the language changes. */
export function t(key: Key, values: Record<string, unknown> = {}): string {
  return i18next.t(key as string, { lng: spoken, ...values });
}

/** The sentence of a server error by its code; null in English, or for an unknown code. */
export function problemText(code: string, values: Record<string, string>): string | null {
  if (!explained.includes(spoken)) return null;
  const given = { ...values, ...(values.count === undefined ? {} : { count: Number(values.count) }) };
  const how = { ...given, ns: "problems", lng: spoken, interpolation: PLACES };
  return i18next.exists(code, how) ? i18next.t(code, how) : null;
}

export function language(): Language {
  return spoken;
}

/**
 * The locale for dates and numbers: the browser's first entry of this language (en-GB: 20 Nov 2026). English without a
 * country is international, not American.
 */
export function locale(): string {
  const exact = browserLanguages().find((code) => code.startsWith(`${spoken}-`));
  return exact ?? (spoken === "en" ? "en-GB" : spoken);
}

function isKnown(code: string): code is Language {
  return code in LANGUAGES;
}

/** The chosen language, else the first available one of the browser's. */
function preferredLanguage(): Language {
  const requested = [localStorage.getItem(KEPT) ?? "", ...browserLanguages()];
  return requested.map((code) => code.slice(0, 2)).find(isKnown) ?? "en";
}

async function learn(code: Language, area: Area | ""): Promise<void> {
  const texts = await TEXTS[`./${area && `${area}/`}locales/${code}.json`]!();
  i18next.addResourceBundle(code, "translation", texts, true);
}

/** Resolves to a page once the texts of its area are here. Not awaited by a module itself: in Safari, modules that wait and import each other never end. */
export function withTexts(area: Area): <T>(page: T) => Promise<T> {
  return async (page) => {
    learned.add(area);
    await begun;
    await learn(spoken, area);
    return page;
  };
}

/** Resolves once the sentences of server errors are here, or cannot be loaded. */
export function problemsKnown(): Promise<void> {
  return explaining;
}

async function explain(code: Language): Promise<void> {
  const problems = await PROBLEMS[`../../src/walltopo_gym/messages/${code}.json`]?.().catch(() => undefined);
  if (!problems) return;
  i18next.addResourceBundle(code, "problems", problems);
  explained = [...explained, code];
}

export async function speak(code: Language, keep = true): Promise<void> {
  explaining = explain(code);
  await Promise.all([...learned].map((area) => learn(code, area)));
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
    interpolation: VALUES,
  });
  await speak(preferredLanguage(), false);
}

const DAY = { dateStyle: "medium" } as const;

/** A day as the reader writes it; `text` is a date or a moment, ISO 8601. */
export function day(text: string): string {
  // A date without a time is that day everywhere.
  const zone = text.length === 10 ? { timeZone: "UTC" } : {};
  return new Intl.DateTimeFormat(locale(), { ...DAY, ...zone }).format(new Date(text));
}

export function moment(text: string): string {
  return new Intl.DateTimeFormat(locale(), { ...DAY, timeStyle: "short" }).format(new Date(text));
}

/** A moment as short as possible: the time today, else the day too. */
export function time(at: Date): string {
  const isToday = at.toDateString() === new Date().toDateString();
  return new Intl.DateTimeFormat(locale(), isToday ? { timeStyle: "short" } : { ...DAY, timeStyle: "short" }).format(at);
}
