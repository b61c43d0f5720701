/** The parts of one `<wall-topo>`: its elements, its 3D picture, and the tables and selection that they show. */

import type { Insets } from "../camera/fit";
import { CameraViews } from "../camera/views";
import type { Hold, Route, Tables } from "../data/types";
import type { Editor } from "../edit/editor";
import { Crosshair } from "../input/crosshair";
import { GestureCapture, grabMode } from "../input/gesture_capture";
import { say } from "../languages";
import { h } from "../panels/dom";
import { Layout } from "../panels/layout";
import { Placeholder } from "../panels/placeholder";
import { RouteList } from "../panels/route_list";
import { Toast } from "../panels/toast";
import { Toolbar } from "../panels/toolbar";
import type { ToolbarActions } from "../panels/toolbar";
import { Heatmap } from "../scene/heatmap";
import { Overlay } from "../scene/overlay";
import type { Stage } from "../scene/stage";

const TOAST_GAP = 14; // CSS pixels between a toast and what is above it

export class Parts {
  readonly shell = h("div", { class: "shell" });
  readonly view = h("div", { class: "view", part: "view" });
  readonly card = h("section", { class: "card", part: "card", hidden: true });
  readonly toolbar = new Toolbar();
  readonly toast = new Toast();
  readonly heatmap = new Heatmap();
  readonly crosshair = new Crosshair();
  readonly placeholder = new Placeholder();
  /** Grows while the finer tier comes. */
  readonly progressLine = h("div", { class: "thread", hidden: true }, h("i"));
  readonly layout: Layout;
  list = new RouteList();
  canvas = h("canvas");
  stage: Stage | null = null;
  views: CameraViews | null = null;
  overlay: Overlay | null = null;
  editor: Editor | null = null;
  tables: Tables = { title: "", metric: true, holds: new Map(), routes: new Map() };
  /** Ids of the selected route and hold. */
  selected: { route: number | null; hold: number | null } = { route: null, hold: null };
  /** Id of the hold that the keyboard's cursor is on. */
  cursor: number | null = null;
  /** Id of the route whose row in the list has the keyboard's focus. */
  focused: number | null = null;
  private capture: GestureCapture | null = null;

  constructor(readonly element: HTMLElement) {
    const { shell, view, card } = this;
    this.layout = new Layout({ element, shell, view, bar: this.toolbar.root, card });
  }

  get route(): Route | null {
    return this.tables.routes.get(this.selected.route ?? -1) ?? null;
  }

  get hold(): Hold | null {
    return this.tables.holds.get(this.selected.hold ?? -1) ?? null;
  }

  /** Put the elements together, in the language that is spoken now. */
  build(actions: ToolbarActions): void {
    this.card.setAttribute("aria-label", say().words.chosen);
    this.toolbar.build(actions);
    this.list = new RouteList();
    this.view.replaceChildren(
      this.canvas,
      this.crosshair.root,
      this.toolbar.root,
      this.progressLine,
      this.heatmap.root,
      this.toast.root,
    );
    this.shell.replaceChildren(this.list.root, this.view, this.card, this.placeholder.root);
    this.list.sheet.onHeight = () => this.fit(true);
  }

  /** Take the 3D picture, until `signal` says that the element is gone. */
  attach(stage: Stage, signal: AbortSignal): void {
    this.stage = stage;
    this.overlay = new Overlay(stage.rig);
    this.canvas.after(this.overlay.root);
    this.capture = new GestureCapture(this.canvas, stage.rig.controls, (text) => this.say(text), signal);
    this.views = new CameraViews(stage.rig, () => this.insets());
    stage.onFrame = () => this.overlay?.update();
    stage.onLost = (lost) => this.say(lost ? say().words.interrupted : say().words.restored);
    const resizer = new ResizeObserver(() => this.fit());
    resizer.observe(this.element);
    signal.addEventListener("abort", () => resizer.disconnect());
    this.fit();
  }

  /** Free the 3D picture. */
  detach(): void {
    this.editor?.dispose();
    this.editor = null;
    this.stage?.dispose();
    this.stage = null;
    this.views = null;
  }

  /** Arrange the elements, and fit the picture to the room that is left for it. */
  fit(animate = false): void {
    this.arrange();
    if (!this.stage?.rig.framing) return;
    this.views?.refit(animate);
    this.stage.drawNow();
  }

  arrange(): void {
    this.layout.arrange(this.stage?.rig.framing?.aspect, this.insets());
    this.chooseCapture();
    // Before there is a wall to draw its size would be set, and the canvas made anew, for nothing.
    if (this.stage?.rig.framing) this.stage.resize(this.view.clientWidth, this.view.clientHeight);
  }

  /** As the page says; else the wall takes every touch where it is all of the page. */
  chooseCapture(): void {
    this.capture?.set(grabMode(this.element.getAttribute("grab")) ?? (this.layout.alone ? "always" : "two-fingers"));
  }

  /** Whether one finger draws on the wall instead of turning it. */
  draw(drawing: boolean): void {
    this.capture?.draw(drawing);
  }

  /** Show a line over the picture for some seconds. */
  say(text: string): void {
    const bars = [this.layout.tall ? this.toolbar.root : null, this.view.querySelector<HTMLElement>(".edit")];
    this.toast.say(text, TOAST_GAP + Math.max(0, ...bars.map((bar) => (bar ? bar.offsetTop + bar.offsetHeight : 0))));
  }

  emit(name: string, detail: unknown): void {
    this.element.dispatchEvent(new CustomEvent(name, { detail, bubbles: true, composed: true }));
  }

  private insets(): Insets {
    return this.layout.insets(this.selected.route !== null || this.editor?.preview != null, this.editor?.height ?? 0);
  }
}
