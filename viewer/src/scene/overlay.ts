/** Marks over the picture that move with it: start and top flags, the measuring line, lines and ropes of the page. */

import { Vector3 } from "three";
import type { CameraRig } from "../camera/camera_rig";
import type { Hold, Route, Tables, Vec3 } from "../data/types";
import { say } from "../languages";
import { measured } from "../data/lengths";
import { lengthText } from "../languages/format";
import { measures } from "../languages/units";
import { h } from "../panels/dom";
import { RouteNames } from "./route_names";

interface Pin {
  element: HTMLElement;
  place: Vec3;
}

type Kind = "start" | "top" | "zone" | "foot";

/** A word over the picture: what it says and where it points to, in CSS pixels. */
export interface Flag {
  word: string;
  kind: Kind;
  x: number;
  y: number;
}

/** A route, or other holds with flags. */
type Flagged = Pick<Route, "holds" | "start" | "top" | "zone">;

const SVG = "http://www.w3.org/2000/svg";

export class Overlay {
  readonly root = h("div", { class: "overlay", "aria-hidden": "true" });
  private readonly line = document.createElementNS(SVG, "line");
  /** Drawn twice, a dark stroke below a dashed light one, so that they are seen on every colour. */
  private readonly strokes = ["below", "above"].map(strokeOf);
  /** The ropes of the page, drawn as the lines are, but solid. */
  private readonly ropeStrokes = ["below", "rope"].map(strokeOf);
  private readonly label = h("div", { class: "length" });
  private pins: Pin[] = [];
  private dots: Pin[] = [];
  private ends: Vector3[] = [];
  private marks: Pin[] = [];
  private lines: Vec3[][] = [];
  private ropes: Vec3[][] = [];
  private clips: Pin[] = [];
  readonly names = new RouteNames(this.root);

  constructor(private readonly rig: CameraRig) {
    const svg = document.createElementNS(SVG, "svg");
    svg.append(...this.strokes, ...this.ropeStrokes, this.line);
    this.root.append(svg, this.label);
    this.clearMeasure();
  }

  /** Flags at the first and last holds, and at `feet`: distinct by shape and word, not by colour. */
  flags(route: Flagged | null, tables: Tables, feet: number[] = []): void {
    for (const { element } of this.pins) element.remove();
    this.pins = [];
    if (!route) return;
    const add = (ids: number[], kind: Kind): void => {
      for (const id of ids) {
        const hold: Hold | undefined = tables.holds.get(id);
        if (!hold) continue;
        const word = say().words[kind];
        const element = h("div", { class: `flag ${kind}`, "data-kind": kind }, h("span", { part: "flag" }, word));
        const rise = (hold.size_m ?? 0.1) * 0.5;
        const [x, y, z] = hold.position;
        this.pins.push({ element, place: [x, y, kind === "top" ? z + rise : z - rise] });
        this.root.append(element);
      }
    };
    add(route.start ?? route.holds.slice(0, 1), "start");
    add(route.top ?? route.holds.slice(-1), "top");
    add(route.zone ?? [], "zone");
    add(feet, "foot");
  }

  /** The flags as they stand in the picture now. */
  get flagged(): Flag[] {
    return this.pins.flatMap(({ element, place }) => {
      const { x, y, ahead } = this.rig.project(place);
      const kind = element.dataset["kind"] as Kind;
      return ahead ? [{ word: element.textContent ?? "", kind, x, y }] : [];
    });
  }

  /** Dots at places, in the stead of those before. */
  mark(places: Vec3[]): void {
    for (const { element } of this.marks) element.remove();
    this.marks = places.map((place) => ({ element: h("div", { class: "dot" }), place }));
    this.root.append(...this.marks.map(({ element }) => element));
  }

  /** Dashed lines through places, in the stead of those before. */
  draw(lines: Vec3[][]): void {
    this.lines = lines;
  }

  /** Ropes, each through its clips to the anchor, in the stead of those before. */
  hang(ropes: Vec3[][]): void {
    if (ropes === this.ropes) return;
    this.ropes = ropes;
    for (const { element } of this.clips) element.remove();
    this.clips = ropes.flatMap((rope) =>
      rope.map((place, at) => ({ element: h("div", { class: at === rope.length - 1 ? "clip anchor" : "clip" }), place })),
    );
    this.root.append(...this.clips.map(({ element }) => element));
  }

  /** One more end of the measuring line; the third begins a new one. Gives the length. */
  measure(point: Vector3, metric: boolean): string | null {
    if (this.ends.length === 2) this.clearMeasure();
    this.ends.push(point.clone());
    const element = h("div", { class: "dot" });
    this.dots.push({ element, place: [point.x, point.y, point.z] });
    this.root.append(element);
    if (this.ends.length < 2) return null;
    const length = this.ends[0]!.distanceTo(this.ends[1]!);
    const text = metric ? measured(length, measures()) : lengthText(length, false);
    this.label.textContent = text;
    this.label.hidden = false;
    this.line.style.display = "";
    return text;
  }

  /** The ends of the measuring line, once there are two. */
  get measured(): Vec3[] {
    return this.ends.map((end) => end.toArray());
  }

  clearMeasure(): void {
    for (const { element } of this.dots) element.remove();
    this.dots = [];
    this.ends = [];
    this.label.hidden = true;
    this.line.style.display = "none";
  }

  update(): void {
    this.names.update(this.rig);
    for (const { element, place } of [...this.pins, ...this.dots, ...this.marks, ...this.clips]) {
      const at = this.rig.project(place);
      element.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px)`;
      element.style.visibility = at.ahead ? "visible" : "hidden";
    }
    this.trace(this.strokes, this.lines);
    this.trace(this.ropeStrokes, this.ropes);
    if (this.ends.length < 2) return;
    const [a, b] = this.ends.map((end) => this.rig.project(end));
    this.line.setAttribute("x1", String(a!.x));
    this.line.setAttribute("y1", String(a!.y));
    this.line.setAttribute("x2", String(b!.x));
    this.line.setAttribute("y2", String(b!.y));
    const [x, y] = [(a!.x + b!.x) / 2, (a!.y + b!.y) / 2];
    this.label.style.transform = `translate(${x}px, ${y}px) translate(-50%, -50%)`;
  }

  private trace(strokes: SVGPathElement[], lines: Vec3[][]): void {
    const path = pathOf(lines, (place) => this.rig.project(place));
    for (const stroke of strokes) stroke.setAttribute("d", path);
  }
}

function strokeOf(layer: string): SVGPathElement {
  const path = document.createElementNS(SVG, "path");
  path.classList.add(layer);
  return path;
}

/** An SVG path of lines through places; each is interrupted where it is behind the camera. */
export function pathOf(lines: Vec3[][], project: (place: Vec3) => { x: number; y: number; ahead: boolean }): string {
  return lines
    .flatMap((line) => {
      let pen = "M";
      return line.map((place) => {
        const { x, y, ahead } = project(place);
        const step = ahead ? `${pen}${x.toFixed(1)} ${y.toFixed(1)}` : "";
        pen = ahead ? "L" : "M";
        return step;
      });
    })
    .join("");
}
