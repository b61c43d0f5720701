/** The parts of the panel that proposes problems: the requested properties, and rows of what was found. */

import { inMetres } from "../data/lengths";
import type { Hold } from "../data/types";
import type { ClimberRow, Proposal, Tweak, ProblemSpec as WireSpec } from "../data/wire";
import { decimal, say } from "../languages";
import { holdName } from "../languages/format";
import { measures } from "../languages/units";
import { h } from "../panels/dom";
import { choice } from "./form";

export type ProblemSpec = Required<Omit<WireSpec, "span_m">>;

const GRADES = "4 5 5+ 6A 6A+ 6B 6B+ 6C 6C+ 7A 7A+ 7B 7B+ 7C 7C+ 8A 8A+ 8B".split(" ");
const KINDS = ["jugs", "crimps", "slopers", "pinches", "pockets", "small", "large"] as const;
const STEEPNESS = ["slab", "vertical", "overhang", "steep"] as const;
/** Heights of `walltopo_climb.movement.body.BODIES`. */
const BODIES = [["child", 1.3], ["short", 1.55], ["adult", 1.75], ["tall", 1.9]] as const;

/** The fields; each change passes the whole spec. */
export function specFields(first: ProblemSpec, changed: (spec: ProblemSpec) => void): HTMLElement {
  const { proposing, words, people } = say();
  let spec = first;
  const set = (part: Partial<ProblemSpec>): void => changed((spec = { ...spec, ...part }));
  let [low, high] = spec.grade.split("-") as [string, string];
  const grades = GRADES.map((grade): [string, string] => [grade, grade]);
  const any: ["any", string] = ["any", proposing.any];
  const order = (): void => {
    if (GRADES.indexOf(low) > GRADES.indexOf(high)) [low, high] = [high, low];
    set({ grade: `${low}-${high}` });
  };
  const counts = Array.from({ length: 11 }, (_, k): [string, string] => [String(k + 2), String(k + 2)]);
  return h(
    "div",
    { class: "fields" },
    choice(proposing.from, grades, low, (grade) => ((low = grade), order())),
    choice(proposing.to, grades, high, (grade) => ((high = grade), order())),
    choice(proposing.moves, counts, String(spec.moves), (moves) => set({ moves: Number(moves) })),
    choice(words.steepness, [any, ...STEEPNESS.map((one): [ProblemSpec["steepness"], string] => [one, words[one]])], spec.steepness, (steepness) => set({ steepness })),
    choice(proposing.reach, [any, ["static", proposing.static], ["dynamic", proposing.dynamic]], spec.reach, (reach) => set({ reach })),
    choice(proposing.kind, [any, ...KINDS.map((one): [ProblemSpec["holds"], string] => [one, proposing.kinds[one]])], spec.holds, (holds) => set({ holds })),
    choice(
      proposing.body,
      BODIES.map(([name, height]): [string, string] => [String(height), `${people[name]}, ${inMetres(height, measures())}`]),
      String(spec.height_m),
      (height) => set({ height_m: Number(height) }),
    ),
  );
}

function row(name: string, facts: string[], pressed: boolean, act: () => void): HTMLElement {
  return h(
    "button",
    { class: "route plain", "aria-pressed": String(pressed), onClick: act },
    h("span", { class: "name" }, name),
    h("span", { class: "meta" }, facts.join(" · ")),
  );
}

export function proposalRow(one: Proposal, k: number, pressed: boolean, act: () => void): HTMLElement {
  const { proposing, gradeRange } = say();
  const { low, high, graded } = one.grade;
  return row(`${k + 1} · ${proposing.moveCount(one.moves)}`, [gradeRange(low, high, graded ?? 0)], pressed, act);
}

export function tweakRow(one: Tweak, hold: Hold, pressed: boolean, act: () => void): HTMLElement {
  const { proposing } = say();
  const by = proposing.by(decimal(Math.abs(one.by), 1), one.by > 0);
  const percent = Math.round(100 * one.eases);
  return row(proposing.change[one.do](holdName(hold)), [by, ...(percent ? [proposing.crux(percent)] : [])], pressed, act);
}

/** Warnings for climbers who do not get up, or have to leap. */
export function peopleWords(climbers: readonly ClimberRow[]): HTMLElement[] {
  const { people, unreached, leap, proposing } = say();
  return climbers.flatMap(({ climber, moves, reached }) => {
    const far = Math.max(0, ...moves.map(({ beyond_m }) => beyond_m ?? 0));
    const why = moves.length === 0 ? proposing.noStart : !reached ? unreached : far > 0 ? leap(inMetres(far, measures())) : "";
    const name = people[climber as keyof typeof people] ?? climber;
    return why ? [h("p", { class: "doubt warn" }, `${name}: ${why}`)] : [];
  });
}
