/** Painting with a ball: what a finger drawn over the wall gives to a hold, or to the wall. */

import type { Vector3 } from "three";
import type { Hold, Vec3 } from "../data/types";
import type { Hit } from "../input/picking";
import { holdSwatch } from "../panels/swatch";
import { NONE, refOf } from "./edit_log";
import type { Edit } from "./edit_log";
import type { EditorHost } from "./editor_host";

export class Brush {
  /** Metres. */
  radius = 0.03;
  private stroke: Edit[] | null = null;
  private last: Vector3 | null = null;
  private balls: (() => void)[] = [];

  /** `target`: whom a stroke is for, null: the wall, undefined: nothing is painted now. */
  constructor(
    private readonly host: EditorHost,
    private readonly target: () => Hold | null | undefined,
    private readonly done: (stroke: Edit[]) => void,
    signal: AbortSignal,
  ) {
    const { canvas } = host;
    canvas.addEventListener("pointerdown", (event) => {
      if (this.target() === undefined || event.button !== 0) return;
      if (!event.isPrimary) return this.cancel(); // two fingers move the wall
      this.begin();
      this.paint(event);
    }, { signal });
    canvas.addEventListener("pointermove", (event) => this.stroke && this.paint(event), { signal });
    window.addEventListener("pointerup", () => this.end(), { signal });
    window.addEventListener("pointercancel", () => this.end(), { signal });
  }

  /** Take the balls away: the surface itself shows the stroke now. */
  clear(): void {
    for (const remove of this.balls) remove();
    this.balls = [];
  }

  /** One ball, as a stroke of its own; false where nothing is painted now. */
  dab(hit: Hit | null): boolean {
    if (this.target() === undefined) return false;
    this.begin();
    this.touch(hit);
    this.end();
    return true;
  }

  private begin(): void {
    this.stroke = [];
    this.last = null;
  }

  private cancel(): void {
    if (!this.stroke) return;
    const shown = this.balls.splice(this.balls.length - this.stroke.length);
    for (const remove of shown) remove();
    this.stroke = null;
    this.host.stage.redraw();
  }

  private paint(event: PointerEvent): void {
    const { canvas, stage } = this.host;
    const box = canvas.getBoundingClientRect();
    this.touch(stage.pick(event.clientX - box.left, event.clientY - box.top));
  }

  private touch(hit: Hit | null): void {
    if (!hit || (this.last && this.last.distanceTo(hit.point) < this.radius * 0.5)) return;
    this.last = hit.point;
    const target = this.target() ?? null;
    const at = hit.point.toArray().map((v) => Number(v.toFixed(4))) as Vec3;
    this.stroke!.push({ do: "paint", hold: target ? refOf(target) : NONE, at, radius_m: this.radius });
    this.balls.push(this.host.stage.paintBall(hit.point, this.radius, target ? holdSwatch(target) : "#ffffff"));
  }

  private end(): void {
    if (!this.stroke) return;
    const stroke = this.stroke;
    this.stroke = null;
    if (stroke.length > 0) this.done(stroke);
  }
}
