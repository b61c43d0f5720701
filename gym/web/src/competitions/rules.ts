/** The rules of a competition in plain words, a sentence each. */

import { t } from "../i18n.svelte";
import { number } from "../lib/format";
import { problemName } from "./words";
import type { Problem, Round, Scoring, Sheet } from "./facts";

/** The points of a round, and how ties are broken. */
export function scoringWords({ rules, flash, top, zone, best }: Scoring): string[] {
  const worth = { flash: number(flash ?? 120), top: number(top ?? (rules === "shared" ? 1000 : 100)), zone: number(zone ?? (rules === "shared" ? 0 : 40)) };
  const lines = [t(`comp.rule.${rules}`, worth)];
  if (hasWorth({ rules })) lines.push(best ? t("comp.rule.best", { count: best }) : t("comp.rule.all"));
  if (rules === "lead-points") lines.push(best ? t("comp.rule.bestRoutes", { count: best }) : t("comp.rule.allRoutes"));
  return lines;
}

/** Whether results of a round are high points on routes. */
export function isLead({ rules }: Scoring): boolean {
  return rules === "ifsc-lead" || rules === "lead-points";
}

/** Whether the best few problems may count. */
export function hasBest(scoring: Scoring): boolean {
  return hasWorth(scoring) || scoring.rules === "lead-points";
}

/** Whether problems of a round can have points of their own. */
export function hasWorth({ rules }: Scoring): boolean {
  return rules === "points" || rules === "shared";
}

export type Part = Pick<Round, "name" | "scoring" | "quota" | "max_attempts"> & { problems: Pick<Problem, "points">[] };

export function roundWords({ scoring, quota, max_attempts, problems }: Part): string[] {
  const lines = [countWords(scoring, problems.length)];
  if (quota) lines.push(t("comp.rule.quota", { count: quota }));
  const own = hasWorth(scoring) ? problems.filter(({ points }) => points).length : 0;
  return [...lines, ...scoringWords(scoring), ...(max_attempts ? [t("comp.rule.attempts", { count: max_attempts })] : []), ...(own ? [t("comp.rule.own", { count: own })] : [])];
}

/** The number of problems, or of routes. */
export function countWords(scoring: Scoring, count: number): string {
  return t(isLead(scoring) ? "comp.routes" : "comp.problems", { count });
}

/** The number of a problem, or of a route. */
export function numberWords(scoring: Scoring, number: number | string): string {
  return t(isLead(scoring) ? "comp.routeNumber" : "comp.problemNumber", { number });
}

/** A problem in full: its number or label, and the route's name or colour. */
export function fullName(scoring: Scoring, { label, name, colour }: Pick<Problem, "label" | "name" | "colour">): string {
  return [numberWords(scoring, label), problemName({ label: "", name, colour })].filter(Boolean).join(" · ");
}

/** A problem's own points; empty if it has the round's. */
export function worthWords({ rules }: Scoring, { points }: Pick<Problem, "points">): string {
  if (!points || (rules !== "points" && rules !== "shared")) return "";
  return t(`comp.worth.${rules}`, { flash: number(points.flash), top: number(points.top), zone: number(points.zone) });
}

type Whole = Pick<Sheet, "format" | "self_entry" | "self_scoring" | "waiver" | "fee" | "league_best" | "team_size" | "late_minutes">;

export function wholeWords(sheet: Whole): string[] {
  const lines = [t(`comp.rule.${sheet.format}`)];
  if (sheet.format === "league") {
    lines.push(sheet.league_best ? t("comp.rule.weeks", { count: sheet.league_best }) : t("comp.rule.allWeeks"));
    if (sheet.team_size) lines.push(t("comp.rule.team", { count: sheet.team_size }));
  }
  lines.push(t(sheet.self_entry ? "comp.rule.selfEntry" : "comp.rule.listEntry"));
  lines.push(sheet.self_scoring ? t("comp.rule.selfScoring", { count: sheet.late_minutes }) : t("comp.rule.judges"));
  if (sheet.waiver) lines.push(t("comp.rule.waiver"));
  if (sheet.fee) lines.push(t("comp.rule.fee", { fee: sheet.fee }));
  return lines;
}
