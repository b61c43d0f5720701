/** Taps, the mouse and keys on the picture: selecting, measuring, looking closer. */

import { Vector3 } from "three";
import { nearestTo, nextInDirection } from "../input/hold_cursor";
import type { Direction } from "../input/hold_cursor";
import { handleKey } from "../input/keyboard";
import type { Hit } from "../input/picking";
import { listenForTaps } from "../input/taps";
import { say } from "../languages";
import type { Parts } from "./parts";
import type { Selection } from "./selection";

/** Views that the toolbar offers too. */
export interface ViewActions {
  home(): void;
  climber(): void;
}

export class Interaction {
  private isMeasuring = false;
  private isPointing = false;
  private touched: Vector3 | null = null;
  /** The last hold of the keyboard's cursor, until somebody taps; it is drawn while the picture has the focus. */
  private cursor: number | null = null;

  constructor(
    private readonly parts: Parts,
    private readonly selection: Selection,
    private readonly actions: ViewActions,
  ) {}

  /** Whether taps measure a distance. */
  get measuring(): boolean {
    return this.isMeasuring;
  }

  set measuring(on: boolean) {
    const { toolbar, view, overlay, stage } = this.parts;
    this.isMeasuring = on;
    toolbar.press(on);
    view.classList.toggle("measuring", on);
    overlay?.clearMeasure();
    stage?.redraw();
    if (on) this.parts.say(say().words.twoPoints);
  }

  /** Whether taps emit their place on the wall and choose nothing. */
  get pointing(): boolean {
    return this.isPointing;
  }

  set pointing(on: boolean) {
    this.isPointing = on;
    this.parts.view.classList.toggle("pointing", on);
  }

  /** Whether a tap needs a place of the wall, which the crosshair gives to keys. */
  private get isAiming(): boolean {
    return this.isMeasuring || this.isPointing || this.parts.editor?.isAiming === true;
  }

  /** Until `signal` says that the element is gone. */
  listen(signal: AbortSignal): void {
    const { canvas, card, crosshair } = this.parts;
    const taps = {
      tap: (x: number, y: number) => this.tapped(x, y),
      double: () => this.lookCloser(),
    };
    listenForTaps(canvas, taps, signal);
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("pointermove", (event) => this.hover(event));
    canvas.addEventListener("blur", () => {
      this.selection.moveCursor(null);
      crosshair.hide();
    });
    card.addEventListener("keydown", ({ key }) => key === "Escape" && canvas.focus(), { signal });
    canvas.addEventListener("focus", () => this.selection.moveCursor(this.cursor));
  }

  /** With a mouse, the pointer tells what can be selected. */
  private hover({ pointerType, buttons, offsetX, offsetY }: PointerEvent): void {
    const { stage, canvas, tables } = this.parts;
    if (pointerType !== "mouse" || buttons !== 0 || !stage?.rig.framing) return;
    const hold = stage.pick(offsetX, offsetY)?.hold ?? 0;
    canvas.classList.toggle("on-hold", tables.holds.has(hold));
  }

  private tapped(x: number, y: number): void {
    this.cursor = null;
    this.parts.crosshair.hide();
    this.selection.moveCursor(null);
    this.act(this.parts.stage!.pick(x, y));
  }

  /** A tap on the wall, or Enter on the cursor's hold. */
  private act(hit: Hit | null): void {
    const { parts, selection } = this;
    this.touched = hit?.point ?? null;
    if (this.isMeasuring) {
      if (hit) this.measure(hit.point);
      return;
    }
    if (this.isPointing) {
      if (hit) parts.emit("point-tap", { point: hit.point.toArray() });
      return;
    }
    if (selection.set) return parts.emit("hold-tap", { hold: parts.tables.holds.get(hit?.hold ?? 0) ?? null });
    if (parts.editor?.tapped(hit)) return;
    if (hit && hit.hold > 0 && parts.tables.holds.has(hit.hold)) selection.hold(hit.hold);
    else selection.choose(null, null);
  }

  private measure(point: Vector3): void {
    const { parts } = this;
    const length = parts.overlay!.measure(point, parts.tables.metric);
    parts.stage!.redraw();
    if (!length) return parts.say(say().words.secondPoint);
    parts.toast.announce(length);
    parts.emit("measure", { text: length, ends: parts.overlay!.measured });
  }

  /** Closer to where the first of two taps was: what it selected may have moved the picture since. */
  private lookCloser(): void {
    if (this.touched && !this.isMeasuring && !this.isPointing) this.parts.views!.closer(this.touched);
  }

  private step(to: Direction): void {
    if (this.isAiming) this.aim(to);
    else this.stepCursor(to);
  }

  private enter(): void {
    const { crosshair, stage, editor } = this.parts;
    if (!this.isAiming) return this.actAtCursor();
    if (!crosshair.place) return this.aim(null);
    const hit = stage!.pick(crosshair.place.x, crosshair.place.y);
    if (!editor?.paintAt(hit)) this.act(hit);
  }

  /** The crosshair goes a step, or appears at the selected hold or in the middle; screen readers hear what is there. */
  private aim(to: Direction | null): void {
    const { crosshair, canvas, stage, hold, tables, toast } = this.parts;
    if (!crosshair.place) {
      const at = hold ? stage!.rig.project(hold.position) : null;
      crosshair.show(at?.ahead ? at : { x: canvas.clientWidth / 2, y: canvas.clientHeight / 2 });
    } else if (to) crosshair.step(to, canvas);
    const hit = stage!.pick(crosshair.place!.x, crosshair.place!.y);
    toast.announce(hit ? this.selection.placeWords(hit.point, tables.holds.get(hit.hold)) : say().words.beside);
  }

  /** The cursor goes to the next hold in a direction of the picture, and the camera after it where it leaves the picture. */
  private stepCursor(to: Direction): void {
    const { parts, selection } = this;
    const { rig } = parts.stage!;
    const places = new Map<number, { x: number; y: number }>();
    for (const { id, position } of parts.tables.holds.values()) {
      const { x, y, ahead } = rig.project(position);
      if (ahead) places.set(id, { x, y });
    }
    const from = parts.cursor ?? parts.selected.hold;
    const here = places.get(from ?? -1);
    const { clientWidth, clientHeight } = parts.canvas;
    const next = here ? nextInDirection(places, here, to) : nearestTo(places, { x: clientWidth / 2, y: clientHeight / 2 });
    if (next === null) return;
    this.cursor = next;
    selection.moveCursor(next);
  }

  /** Enter chooses the cursor's hold, and once more leads to its card. */
  private actAtCursor(): void {
    const { parts } = this;
    const hold = parts.tables.holds.get(parts.cursor ?? -1);
    if (!hold) return;
    const isChosen = hold.id === parts.selected.hold && !parts.card.hidden;
    if (isChosen) parts.card.querySelector("h3")?.focus();
    else this.act({ point: new Vector3(...hold.position), hold: hold.id });
  }

  private key(event: KeyboardEvent): void {
    const { parts, selection } = this;
    const toggle = (): void => void (this.measuring = !this.isMeasuring);
    if (!this.isAiming) parts.crosshair.hide();
    const did = handleKey(event, {
      controls: parts.stage!.rig.controls,
      moved: () => parts.views!.markMoved(),
      step: (by) => selection.step(by),
      cursor: (to) => this.step(to),
      tap: () => this.enter(),
      escape: () => {
        if (this.isMeasuring) toggle();
        else if (!parts.editor?.escape()) selection.choose(null, null);
      },
      home: () => this.actions.home(),
      climber: () => this.actions.climber(),
      measure: toggle,
    });
    if (did) parts.stage!.redraw();
  }
}
