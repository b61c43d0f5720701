/** A competition in the wizard: a new one, or a copy of an existing one. */

import type { Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import type { Category, Format, Problem, RuleName, Scoring, Sheet } from "./facts";

/** A new problem, of a current route or without a route. */
export type NewProblem = Pick<Problem, "route_id" | "label" | "points">;
/** Without an id: new. */
export type CategoryDraft = Omit<Category, "id" | "entries"> & { id?: string };
export interface RoundDraft {
  id?: string;
  name: string;
  kind: NonNullable<Schemas["RoundBody"]["kind"]>;
  scoring: Scoring;
  quota: number | null;
  opens_at: string | null;
  closes_at: string | null;
  /** Existing problems. */
  problems: Problem[];
  /** New ones, those of routes first. */
  fresh: NewProblem[];
}
export interface Draft {
  format: Format;
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

/** The rules that a round may have: a league adds up points. */
export function rulesOf(format: Format): RuleName[] {
  if (format === "night") return ["most"];
  if (format === "rounds") return ["ifsc-2025", "ifsc-2018", "points"];
  return format === "league" ? ["points", "shared", "ifsc-2025"] : ["points", "shared", "ifsc-2025", "ifsc-2018"];
}

/** The numbers that usually go with rules. */
export function usual(rules: RuleName): Scoring {
  if (rules === "points") return { ...SCORING.festival };
  return rules === "shared" ? { rules, top: 1000, zone: 0, best: null } : { rules };
}

export function newRound(format: Format, kind: RoundDraft["kind"], name: string, quota: number | null = null): RoundDraft {
  return { name, kind, scoring: { ...SCORING[format] }, quota, opens_at: null, closes_at: null, problems: [], fresh: [] };
}

const NEW_PROBLEM: NewProblem = { route_id: null, label: "", points: null };

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
    ...routes.map((route_id) => round.fresh.find((one) => one.route_id === route_id) ?? { ...NEW_PROBLEM, route_id }),
    ...Array.from({ length: blanks }, (_, at) => empty[at] ?? { ...NEW_PROBLEM }),
  ];
}

/** The rounds that a format begins with. */
export function roundsOf(format: Format): RoundDraft[] {
  if (format === "rounds") {
    const [first, last] = [newRound(format, "qualification", t("comp.round.qualification")), newRound(format, "final", t("comp.round.final"), 6)];
    return [first, { ...last, fresh: newProblems(last, [], 4) }];
  }
  if (format === "league") return [newRound(format, "week", t("comp.roundNumber", { number: 1 }))];
  return [newRound(format, "open", t(`comp.format.${format}`))];
}

export function newDraft(): Draft {
  const category = (gender: "women" | "men"): CategoryDraft => ({ name: t(`profile.${gender}`), gender, born_from: null, born_to: null });
  return {
    format: "festival", name: "", about: "", fee: "", waiver: "", starts_at: null, ends_at: null, self_entry: true, self_scoring: true, late_minutes: 60,
    league_best: null, team_size: null, categories: [category("women"), category("men")], rounds: roundsOf("festival"),
  };
}

export function draftOf(sheet: Sheet): Draft {
  const { format, name, about, fee, waiver, starts_at, ends_at, self_entry, self_scoring, late_minutes, league_best, team_size, categories } = sheet;
  const rounds = sheet.rounds.map(({ state: _s, begun_at: _b, ...round }) => ({ ...round, kind: round.kind as RoundDraft["kind"], scoring: { ...round.scoring }, problems: round.problems.map((problem) => ({ ...problem })), fresh: [] }));
  return {
    format, name, about, fee, waiver, starts_at, ends_at, self_entry, self_scoring, late_minutes, league_best, team_size,
    categories: categories.map(({ entries: _, ...category }) => category), rounds,
  };
}

/** All problems of a round, as far as both kinds have it. */
export function allOf(round: Pick<RoundDraft, "problems" | "fresh">): NewProblem[] {
  return [...round.problems, ...round.fresh];
}

/** The words of it, without format and sheet. */
export function wordsOf({ format: _f, categories: _c, rounds: _r, ...words }: Draft) {
  return words;
}

/** Its sheet as the server takes it: an entry without an id is new. An only round ends with the competition. */
export function sheetOf({ format, categories, rounds, starts_at, ends_at }: Draft) {
  const times = format === "festival" || format === "night" ? { opens_at: starts_at, closes_at: ends_at } : {};
  const unsaid = { name: "", colour: "", grade: "", wall: "", category_ids: [] };
  return {
    categories: categories.map((category) => ({ ...category })),
    rounds: rounds.map(({ fresh, problems, ...round }) => ({ ...round, ...times, problems: [...problems, ...fresh.map((one) => ({ ...unsaid, ...one }))] })),
  };
}
