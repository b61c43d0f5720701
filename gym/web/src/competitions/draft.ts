/** A competition in the wizard: a new one, or a copy of an existing one. */

import type { Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import type { Category, Format, Problem, RuleName, Scoring, Sheet } from "./facts";
import { isLead } from "./rules";

/** A new problem, of a current route or without a route. */
export type NewProblem = Pick<Problem, "route_id" | "label" | "points" | "holds" | "category_ids">;
/** A wave; a new one has no id. The form requires both times. */
export interface WaveDraft {
  id?: string;
  name: string;
  starts_at: string | null;
  ends_at: string | null;
  places: number | null;
}
export type CategoryDraft = Omit<Category, "entries">;
export interface RoundDraft {
  id?: string;
  name: string;
  kind: NonNullable<Schemas["RoundBody"]["kind"]>;
  scoring: Scoring;
  quota: number | null;
  opens_at: string | null;
  closes_at: string | null;
  /** Limit of attempts on each problem. */
  max_attempts: number | null;
  /** Minutes before the start at which isolation closes, and seconds between the starts of two climbers. */
  isolation_minutes: number | null;
  rotation_seconds: number | null;
  waves: WaveDraft[];
  /** Existing problems. */
  problems: Problem[];
  /** New ones, those of routes first. */
  fresh: NewProblem[];
}
export interface Draft {
  /** The usual format that filled it, while the wizard is open; null: another one. Not stored. */
  template: TemplateName | null;
  /** The rounds and categories as a format filled them last. Not stored. */
  filled: string;
  format: Format;
  /** With ropes: results are high points. Not stored; the rules of the rounds say it. */
  rope: boolean;
  name: string;
  about: string;
  fee: string;
  waiver: string;
  starts_at: string | null;
  ends_at: string | null;
  self_entry: boolean;
  self_scoring: boolean;
  late_minutes: number;
  league_best: number | null;
  team_size: number | null;
  categories: CategoryDraft[];
  rounds: RoundDraft[];
}

const SCORING: Record<Format, Scoring> = {
  festival: { rules: "points", flash: 120, top: 100, zone: 40, best: null },
  rounds: { rules: "ifsc-2025" },
  league: { rules: "points", flash: 120, top: 100, zone: 40, best: null },
  night: { rules: "most" },
};

const ROPE_RULES: Record<Format, RuleName[]> = {
  festival: ["lead-points", "ifsc-lead"],
  rounds: ["ifsc-lead", "lead-points"],
  league: ["lead-points"],
  night: ["lead-points"],
};

/** The formats of competitions with ropes or without. */
export function formatsOf(rope: boolean): Format[] {
  return rope ? ["festival", "rounds", "league"] : ["festival", "night", "rounds", "league"];
}

/** The rules that a round may have: a league adds up points. */
export function rulesOf(format: Format, rope: boolean): RuleName[] {
  if (rope) return ROPE_RULES[format];
  if (format === "night") return ["most"];
  if (format === "rounds") return ["ifsc-2025", "ifsc-2018", "points"];
  return format === "league" ? ["points", "shared", "ifsc-2025"] : ["points", "shared", "ifsc-2025", "ifsc-2018"];
}

/** The numbers that usually go with rules. */
export function usual(rules: RuleName): Scoring {
  if (rules === "points") return { ...SCORING.festival };
  if (rules === "lead-points") return { rules, best: null };
  return rules === "shared" ? { rules, top: 1000, zone: 0, best: null } : { rules };
}

export function newRound(format: Format, rope: boolean, kind: RoundDraft["kind"], name: string, quota: number | null = null): RoundDraft {
  const scoring = rope ? usual(ROPE_RULES[format][0]!) : { ...SCORING[format] };
  return {
    name, kind, scoring, quota, opens_at: null, closes_at: null, max_attempts: null, isolation_minutes: null, rotation_seconds: null,
    waves: [], problems: [], fresh: [],
  };
}

function newProblem(route_id: string | null = null): NewProblem {
  return { route_id, label: "", points: null, holds: null, category_ids: [] };
}

/** The routes that become new problems. */
export function routesOf(round: Pick<RoundDraft, "fresh">): string[] {
  return round.fresh.flatMap(({ route_id }) => route_id ?? []);
}

export function blanksOf(round: Pick<RoundDraft, "fresh">): number {
  return round.fresh.length - routesOf(round).length;
}

/** New problems of these routes, and so many without a route; edits of problems that stay are kept. */
export function newProblems(round: Pick<RoundDraft, "fresh">, routes: readonly string[], blanks: number): NewProblem[] {
  const empty = round.fresh.filter(({ route_id }) => route_id === null);
  return [
    ...routes.map((route_id) => round.fresh.find((one) => one.route_id === route_id) ?? newProblem(route_id)),
    ...Array.from({ length: blanks }, (_, at) => empty[at] ?? newProblem()),
  ];
}

/** The rounds that a format begins with; with ropes: a qualification on two routes and a final on one. */
export function roundsOf(format: Format, rope: boolean): RoundDraft[] {
  if (format === "rounds") {
    const first = newRound(format, rope, "qualification", t("comp.round.qualification"));
    const last = newRound(format, rope, "final", t("comp.round.final"), rope ? 8 : 6);
    return [{ ...first, fresh: newProblems(first, [], rope ? 2 : 0) }, { ...last, fresh: newProblems(last, [], rope ? 1 : 4) }];
  }
  if (format === "league") return [newRound(format, rope, "week", t("comp.roundNumber", { number: 1 }))];
  return [newRound(format, rope, "open", t(`comp.format.${format}`))];
}

/** A semi-final, as it usually is. */
export function newSemi(rope: boolean): RoundDraft {
  const semi = newRound("rounds", rope, "semi", t("comp.round.semi"), 20);
  return { ...semi, fresh: newProblems(semi, [], rope ? 1 : 4) };
}

/** A new category. Its id is made here, so that problems can name it before it is stored. */
export function newCategory(name: string, gender: Category["gender"] = "", born_from: number | null = null): CategoryDraft {
  return { id: crypto.randomUUID(), name, gender, born_from, born_to: null };
}

/** Remove a category, also from the problems that name it. */
export function removeCategory(draft: Draft, at: number): void {
  const [gone] = draft.categories.splice(at, 1);
  for (const problem of draft.rounds.flatMap(allOf)) problem.category_ids = problem.category_ids.filter((id) => id !== gone?.id);
}

export function newDraft(): Draft {
  const parts = templateParts("scramble");
  return {
    ...parts, filled: fillingOf(parts), name: "", about: "", fee: "", waiver: "", starts_at: null, ends_at: null, self_entry: true, late_minutes: 60,
    league_best: null, team_size: null,
  };
}

/** The usual formats of competitions. */
export const TEMPLATES = ["scramble", "zones", "boulder", "lead"] as const;
export type TemplateName = (typeof TEMPLATES)[number];

const IFSC_PROBLEMS = { qualification: 5, final: 4 } as const;
const IFSC_FINALISTS = 8;
/** Attempts on each problem that a night of tops and zones usually allows. */
const NIGHT_ATTEMPTS = 5;

function templateRounds(name: TemplateName): RoundDraft[] {
  const open = (scoring: Scoring, max_attempts: number | null): RoundDraft[] =>
    [{ ...newRound("festival", false, "open", t("comp.format.festival")), scoring, max_attempts }];
  if (name === "scramble") return open({ rules: "points", flash: 120, top: 100, zone: 0, best: null }, null);
  if (name === "zones") return open({ rules: "ifsc-2018" }, NIGHT_ATTEMPTS);
  // One attempt on each route, by the rules of lead.
  if (name === "lead") return roundsOf("rounds", true).map((round) => ({ ...round, max_attempts: 1 }));
  const [first, last] = roundsOf("rounds", false);
  return [
    { ...first!, fresh: newProblems(first!, [], IFSC_PROBLEMS.qualification) },
    { ...last!, quota: IFSC_FINALISTS, fresh: newProblems(last!, [], IFSC_PROBLEMS.final) },
  ];
}

/** The parts of a draft that a usual format fills; all of them can be changed afterwards. */
export function templateParts(name: TemplateName): Pick<Draft, "template" | "format" | "rope" | "self_scoring" | "categories" | "rounds"> {
  const judged = name === "boulder" || name === "lead";
  const category = (gender: "women" | "men"): CategoryDraft => newCategory(t(`profile.${gender}`), gender);
  return {
    template: name, format: judged ? "rounds" : "festival", rope: name === "lead", self_scoring: !judged,
    categories: [category("women"), category("men")], rounds: templateRounds(name),
  };
}

/** Rounds and categories as one text, to see whether somebody edited them. */
export function fillingOf({ rounds, categories }: Pick<Draft, "rounds" | "categories">): string {
  return JSON.stringify([rounds, categories]);
}

/** The next wave: as long as the one before, and right after it. */
export function nextWave(waves: readonly WaveDraft[], starts_at: string | null): WaveDraft {
  const last = waves.at(-1);
  const name = t("comp.wave.number", { number: waves.length + 1 });
  const begins = last?.ends_at ?? starts_at;
  const long = last?.starts_at && last.ends_at ? Date.parse(last.ends_at) - Date.parse(last.starts_at) : WAVE_MS;
  const ends_at = begins ? new Date(Date.parse(begins) + long).toISOString() : null;
  return { name, starts_at: begins, ends_at, places: last?.places ?? null };
}

const WAVE_MS = 90 * 60_000;

export function draftOf(sheet: Sheet): Draft {
  const { format, name, about, fee, waiver, starts_at, ends_at, self_entry, self_scoring, late_minutes, league_best, team_size, categories } = sheet;
  const rounds = sheet.rounds.map(({ state: _s, begun_at: _b, ...round }) => ({ ...round, kind: round.kind as RoundDraft["kind"], scoring: { ...round.scoring }, problems: round.problems.map((problem) => ({ ...problem })), waves: round.waves.map(({ entries: _, ...wave }) => wave), fresh: [] }));
  return {
    template: null, filled: "", format, rope: sheet.rounds.some(({ scoring }) => isLead(scoring)),
    name, about, fee, waiver, starts_at, ends_at, self_entry, self_scoring, late_minutes, league_best, team_size,
    categories: categories.map(({ entries: _, ...category }) => category), rounds,
  };
}

/** All problems of a round, as far as both kinds have it. */
export function allOf(round: Pick<RoundDraft, "problems" | "fresh">): NewProblem[] {
  return [...round.problems, ...round.fresh];
}

/** The words of it, without format and sheet. */
export function wordsOf({ template: _t, filled: _l, format: _f, rope: _o, categories: _c, rounds: _r, ...words }: Draft) {
  return words;
}

/** Its sheet as the server takes it: a round or problem without an id is new. An only round ends with the competition. */
export function sheetOf({ format, categories, rounds, starts_at, ends_at }: Draft) {
  const times = format === "festival" || format === "night" ? { opens_at: starts_at, closes_at: ends_at } : {};
  const unsaid = { name: "", colour: "", grade: "", wall: "" };
  return {
    categories: categories.map((category) => ({ ...category })),
    rounds: rounds.map(({ fresh, problems, waves, ...round }) => ({
      ...round, ...times, waves: waves.map((wave) => ({ ...wave, starts_at: wave.starts_at ?? "", ends_at: wave.ends_at ?? "" })), problems: [...problems, ...fresh.map((one) => ({ ...unsaid, ...one }))],
    })),
  };
}
