/** Drawing with a ball over the wall: for painting holds, and for hiding places. */

import type { Vector3 } from "three";
import type { Vec3 } from "../data/types";
import type { Hit } from "../input/picking";
import type { Edit } from "./edit_log";
import type { EditorHost } from "./editor_host";

export interface Paint {
  /** Metres. */
  radius: number;
  colour: string;
  edit(at: Vec3, radius: number): Edit;
}

export class Brush {
  private stroke: Edit[] | null = null;
  private last: Vector3 | null = null;
  private balls: (() => void)[] = [];

  /** `paint`: what a stroke is made of, null: nothing is painted now. */
  constructor(
    private readonly host: EditorHost,
    private readonly paint: () => Paint | null,
    private readonly done: (stroke: Edit[]) => void,
    signal: AbortSignal,
  ) {
    const { canvas } = host;
    canvas.addEventListener("pointerdown", (event) => {
      if (this.paint() === null || event.button !== 0) return;
      if (!event.isPrimary) return this.cancel(); // two fingers move the wall
      this.begin();
      this.draw(event);
    }, { signal });
    canvas.addEventListener("pointermove", (event) => this.stroke && this.draw(event), { signal });
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
    if (this.paint() === null) return false;
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

  private draw(event: PointerEvent): void {
    const { canvas, stage } = this.host;
    const box = canvas.getBoundingClientRect();
    this.touch(stage.pick(event.clientX - box.left, event.clientY - box.top));
  }

  private touch(hit: Hit | null): void {
    const paint = this.paint();
    if (!hit || !paint || (this.last && this.last.distanceTo(hit.point) < paint.radius * 0.5)) return;
    this.last = hit.point;
    const at = hit.point.toArray().map((v) => Number(v.toFixed(4))) as Vec3;
    this.stroke!.push(paint.edit(at, paint.radius));
    this.balls.push(this.host.stage.paintBall(hit.point, paint.radius, paint.colour));
  }

  private end(): void {
    if (!this.stroke) return;
    const stroke = this.stroke;
    this.stroke = null;
    if (stroke.length > 0) this.done(stroke);
  }
}
