/** Plays the likely moves of a route: a figure that climbs, step by step or at its own pace. */

import { Vector3 } from "three";
import { inMetres } from "../data/lengths";
import type { Tables } from "../data/types";
import type { ClimberRow, MoveRow, RouteMoves } from "../data/wire";
import { say } from "../languages";
import { measures } from "../languages/units";
import { h, icon } from "../panels/dom";
import type { Stage } from "../scene/stage";
import { Figure } from "./figure";
import type { Pose } from "./figure";
import { nearestClimber } from "./moves_file";
import type { Person } from "./moves_file";

const HAND_S = 0.9; // seconds that a hand takes
const FOOT_S = 0.6;
const REST_S = 0.25; // between two moves
const SITTING = 0.1; // of the height: the hip over the floor
const OVER_HIP = 0.47; // of the height: the top of the head
const PEOPLE = ["child", "short", "adult", "tall", "you", "clip"] as const;

export interface PlayerOptions {
  close?: () => void;
  /** Begin with the climber nearest to this person; else with the adult. A clip's own moves come before both. */
  person?: Person | null;
  /** Receives each climber that is shown. */
  shows?: (climber: ClimberRow) => void;
}

export class Player {
  readonly root = h("div", { class: "player", role: "group", part: "player" });
  private readonly status = h("p", { class: "note", "aria-live": "polite" });
  private readonly go = h("button", { class: "pill main" });
  private climber: ClimberRow;
  private figure: Figure | null = null;
  private at = 0; // the move that was made last
  private poses: Pose[] = [];
  private frame = 0;

  constructor(
    private readonly stage: Stage,
    private readonly tables: Tables,
    moves: RouteMoves,
    private readonly unit: number,
    private readonly options: PlayerOptions = {},
  ) {
    const { close, person } = options;
    const able = moves.climbers.filter((one) => one.moves.length > 0);
    const adult = able.find((one) => one.climber === "adult") ?? able[0]!;
    const filmed = able.find((one) => one.climber === "clip");
    this.climber = filmed ?? (person ? nearestClimber(able, person) : adult);
    const { words } = say();
    const step = (by: number, label: string, shape: "previous" | "next"): HTMLElement =>
      h("button", { class: "tool", "aria-label": label, title: label, onClick: () => this.step(by) }, icon(shape));
    const shut = close && h("button", { class: "tool", "aria-label": words.close, title: words.close, onClick: close }, icon("close"));
    this.go.addEventListener("click", () => (this.frame ? this.pause() : this.play()));
    this.root.setAttribute("aria-label", words.mayGo);
    this.root.append(
      h("div", { class: "top" }, this.people(able), shut),
      this.status,
      h("div", { class: "actions" }, step(-1, words.moveBack, "previous"), this.go, step(1, words.moveOn, "next")),
    );
    this.take(this.climber);
  }

  /** The climber on the wall. */
  get shown(): ClimberRow {
    return this.climber;
  }

  /** The places of the figure's head, hip and limbs in all poses. */
  get places(): Vector3[] {
    const head = new Vector3(0, 0, OVER_HIP * this.climber.height_m * this.unit);
    return this.poses.flatMap(({ hip, ends }) => [hip.clone().add(head), ...ends]);
  }

  /** Seconds that all moves take. */
  get length(): number {
    return this.climber.moves.reduce((sum, move) => sum + seconds(move) + REST_S, 0);
  }

  /** Show the figure as it is after so many seconds. */
  seek(time: number): void {
    let left = time;
    const { moves } = this.climber;
    for (let k = 1; k < moves.length; k++) {
      const takes = seconds(moves[k]!);
      if (left < takes) return this.between(k, left / takes);
      left -= takes + REST_S;
      if (left < 0) return this.show(k);
    }
    this.show(moves.length - 1);
  }

  play(): void {
    if (this.at >= this.climber.moves.length - 1) this.show(0);
    let begun = 0;
    let from = 0;
    for (let k = 1; k <= this.at; k++) from += seconds(this.climber.moves[k]!) + REST_S;
    const tick = (now: number): void => {
      begun ||= now;
      const time = from + (now - begun) / 1000;
      this.seek(time);
      this.frame = time < this.length ? requestAnimationFrame(tick) : 0;
      this.label();
    };
    this.frame = requestAnimationFrame(tick);
    this.label();
  }

  dispose(): void {
    this.pause();
    this.drop();
    this.root.remove();
  }

  private people(able: ClimberRow[]): HTMLElement {
    const { words, people } = say();
    const choose = h("select", { "aria-label": words.climberIs });
    for (const one of able) {
      const known = PEOPLE.find((name) => name === one.climber);
      const name = known ? people[known] : one.climber;
      choose.append(h("option", { value: one.climber }, `${name}, ${inMetres(one.height_m, measures())}`));
    }
    choose.value = this.climber.climber;
    choose.addEventListener("change", () => {
      this.pause();
      this.take(able.find((one) => one.climber === choose.value)!);
    });
    return choose;
  }

  private take(climber: ClimberRow): void {
    this.climber = climber;
    this.drop();
    this.figure = new Figure(climber.height_m * this.unit, climber.span_m * this.unit);
    this.stage.add(this.figure.root);
    this.poses = climber.moves.map((move) => this.poseOf(move));
    this.show(0);
    this.options.shows?.(climber);
  }

  private drop(): void {
    if (!this.figure) return;
    this.stage.remove(this.figure.root);
    this.figure.dispose();
    this.figure = null;
  }

  private pause(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.label();
  }

  private step(by: number): void {
    this.pause();
    this.show(Math.max(0, Math.min(this.climber.moves.length - 1, this.at + by)));
  }

  private show(k: number): void {
    this.at = k;
    this.figure!.pose(this.poses[k]!);
    this.label();
    this.stage.redraw();
  }

  /** The figure on its way to the stance `k`; `share` of the way is done. */
  private between(k: number, share: number): void {
    const [from, to] = [this.poses[k - 1]!, this.poses[k]!];
    const eased = share * share * (3 - 2 * share);
    const out = from.out.clone().lerp(to.out, eased).normalize();
    const off = Math.sin(Math.PI * eased) * 0.08 * this.climber.height_m * this.unit;
    const ends = from.ends.map((end, limb) => {
      const way = end.clone().lerp(to.ends[limb]!, eased);
      // A moving limb leaves the wall on its way; a holding limb stays where it is.
      return end.distanceTo(to.ends[limb]!) > 1e-6 ? way.addScaledVector(out, off) : way;
    }) as Pose["ends"];
    this.at = k - (share < 1 ? 1 : 0);
    this.figure!.pose({ hip: from.hip.clone().lerp(to.hip, eased), ends, out });
    this.label(k);
    this.stage.redraw();
  }

  private poseOf(move: MoveRow): Pose {
    const hip = new Vector3(...move.hip);
    // From a low start one sits: the model knows no floor.
    hip.z = Math.max(hip.z, this.floor + SITTING * this.climber.height_m * this.unit);
    const out = new Vector3();
    const places = move.holds.map((id) => {
      const hold = this.tables.holds.get(id);
      if (!hold) return null;
      out.add(new Vector3(...hold.normal));
      return new Vector3(...hold.position);
    });
    out.normalize();
    const ends = places.map((place, limb) => place ?? this.hanging(hip, out, limb)) as Pose["ends"];
    // Two limbs on one hold lie beside each other.
    const side = new Vector3(0, 0, 1).cross(out).normalize().multiplyScalar(0.02 * this.climber.height_m * this.unit);
    apart(ends, move.holds, side);
    return { hip, ends, out };
  }

  private get floor(): number {
    return this.stage.rig.framing?.floor ?? -Infinity;
  }

  /** The place of a limb that hangs without a hold; from a low start the feet stand on the floor. */
  private hanging(hip: Vector3, out: Vector3, limb: number): Vector3 {
    const height = this.climber.height_m * this.unit;
    const side = new Vector3(0, 0, 1).cross(out).normalize();
    const sign = limb % 2 ? 1 : -1;
    const end = hip
      .clone()
      .addScaledVector(side, sign * 0.1 * height)
      .add(new Vector3(0, 0, -0.46 * height))
      .addScaledVector(out, 0.02 * height);
    return end.setZ(Math.max(end.z, this.floor));
  }

  /** Show the present move, and whether it is in reach. */
  private label(now = this.at): void {
    const { words, limbs, leap, unreached } = say();
    this.go.replaceChildren(icon(this.frame ? "pause" : "play"), this.frame ? words.pause : words.play);
    const { moves, crux, reached } = this.climber;
    const move = moves[now]!;
    const parts = [`${now + 1}/${moves.length}`, limbs[move.limb]];
    if (now === crux && now > 0) parts.push(words.crux);
    if (move.beyond_m) parts.push(leap(inMetres(move.beyond_m, measures())));
    if (!reached && now === moves.length - 1) parts.push(unreached);
    const text = parts.join(" · ");
    if (this.status.textContent !== text) this.status.textContent = text;
    this.status.classList.toggle("warn", Boolean(move.beyond_m) || (!reached && now === moves.length - 1));
  }
}

function seconds({ limb }: MoveRow): number {
  return limb === "left foot" || limb === "right foot" ? FOOT_S : HAND_S;
}

function apart(ends: Pose["ends"], holds: MoveRow["holds"], side: Vector3): void {
  for (const [left, right] of [
    [0, 1],
    [2, 3],
  ] as const) {
    if (holds[left] !== holds[right] || holds[left] === 0) continue;
    ends[left] = ends[left].clone().sub(side);
    ends[right] = ends[right].clone().add(side);
  }
}
