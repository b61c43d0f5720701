/**
 * Edit mode: correct holds and routes by hand. Each step is an entry of the log; what it does to the
 * scan the server tells (the code that the scan itself runs), and that is what is shown.
 */

import { Vector3 } from "three";
import type { Hold, Route, Tables, Vec3 } from "../data/types";
import type { Hit } from "../input/picking";
import { say } from "../languages";
import { h, icon } from "../panels/dom";
import { holdSwatch } from "../panels/swatch";
import { Bar } from "./bar";
import type { Mode } from "./bar";
import { Brush } from "./brush";
import type { Paint } from "./brush";
import { holdControls, leftOutCard, leftOutList, routeControls, severalCard } from "./cards";
import type { Acts } from "./cards";
import { NONE, refOf } from "./edit_log";
import type { Edit } from "./edit_log";
import type { EditorHost } from "./editor_host";
import { lowConfidence } from "./low_confidence";
import { Photos } from "./photos";
import { ProposalPanel } from "./proposing";
import type { Server } from "./server";
import { Session } from "./session";

const NEAR = 0.05; // metres: a tap this near to an instance that was left out means it
const AIMING: readonly Mode[] = ["add", "addVolume", "paint", "erase", "hide", "cut"];
const BRUSHES: readonly Mode[] = ["paint", "erase", "hide"];
const PAINT = { min: 1, max: 12 }; // centimetres: brushes for holds, and for people
const HIDE = { min: 5, max: 50 };
const HIDDEN = "#202020";

export class Editor {
  /** Holds that are marked together. */
  readonly marked = new Set<number>();
  private mode: Mode = "choose";
  /** The instance that is no hold whose card is shown. */
  private absent: number | null = null;
  /** The first of a cut's two places. */
  private from: Vec3 | null = null;
  /** Centimetres. */
  private readonly brushSize = { paint: 3, hide: 15 };
  /** Take the hidden places off the picture. */
  private hidden: (() => void)[] = [];
  /** The selection to make once the server has answered. */
  private then: (() => void) | null = null;
  private readonly session: Session;
  private readonly bar: Bar;
  private readonly brush: Brush;
  private readonly photos: Photos;
  private readonly proposing: ProposalPanel;
  private readonly gone = new AbortController();

  constructor(
    private readonly host: EditorHost,
    base: Tables,
    server: Server,
  ) {
    const { signal } = this.gone;
    const on = { shown: () => this.shown(), stirred: () => this.showBar(), say: (text: string) => host.say(text) };
    this.session = new Session(base, server, on, signal);
    this.photos = new Photos(server);
    const { session } = this;
    this.proposing = new ProposalPanel(host, server, {
      get tables() {
        return session.result.tables;
      },
      get entries() {
        return session.entries;
      },
      nextRouteId: () => session.nextRouteId,
      change: (then, ...step) => {
        this.then = then;
        session.change(...step);
      },
      leave: () => this.setMode("choose"),
    });
    this.bar = new Bar({
      mode: (mode) => this.setMode(mode),
      undo: () => this.session.undo(),
      redo: () => this.session.redo(),
      save: () => void this.session.save(),
      check: () => this.checkNext(),
      brush: (size) => (this.brushSize[this.mode === "hide" ? "hide" : "paint"] = size),
    });
    host.view.append(this.bar.root);
    this.brush = new Brush(host, () => this.paint(), (stroke) => this.stroked(stroke), signal);
    window.addEventListener("keydown", (event) => this.key(event), { signal });
    window.addEventListener("beforeunload", (event) => this.session.changed && event.preventDefault(), { signal });
    this.showBar();
  }

  start(): Promise<void> {
    return this.session.start();
  }

  get height(): number {
    return this.bar.height;
  }

  /** A route that is thought of, to be shown in the stead of the chosen one. */
  get preview(): Route | null {
    return this.proposing.preview;
  }

  dispose(): void {
    this.gone.abort();
    this.proposing.end();
    for (const remove of this.hidden) remove();
    this.host.draw(false);
    this.bar.root.remove();
  }

  // Requests of the page ----------------------------------------------------------------------

  /** True when the tap was the editor's. */
  tapped(hit: Hit | null): boolean {
    const known = hit !== null && this.session.result.tables.holds.has(hit.hold);
    if (this.isBrush) return true;
    if (this.mode === "cut") return this.cutAt(hit);
    if (this.mode === "propose") return true;
    if (this.mode === "several") {
      if (known && !this.marked.delete(hit.hold)) this.marked.add(hit.hold);
      this.host.refresh();
      return true;
    }
    if (this.mode === "add" || this.mode === "addVolume") {
      if (hit && !known) this.addAt(hit.point);
      return !known;
    }
    const absent = known || !hit ? null : this.absentAt(hit.point);
    if (absent) this.host.select(null, null);
    this.absent = absent?.id ?? null;
    if (absent) this.host.refresh();
    return absent !== null;
  }

  /** Whether a tap needs a place of the wall. */
  get isAiming(): boolean {
    return AIMING.includes(this.mode);
  }

  /** True when the place was painted: as a short stroke is. */
  paintAt(hit: Hit | null): boolean {
    return this.isBrush && this.brush.dab(hit);
  }

  private get isBrush(): boolean {
    return BRUSHES.includes(this.mode);
  }

  /** Leave the mode; false when there is none. */
  escape(): boolean {
    const left = this.mode !== "choose";
    if (left) this.setMode("choose");
    return left;
  }

  /** The editor's own card, which replaces that of a hold or route; null without one. */
  card(): HTMLElement[] | null {
    const label = say().words.close;
    const close = h("button", { class: "tool", "aria-label": label, title: label, onClick: () => this.setMode("choose") }, icon("close"));
    if (this.mode === "several") {
      const holds = [...this.marked].flatMap((id) => this.session.result.tables.holds.get(id) ?? []);
      return severalCard(holds, { ...this.acts(), done: () => this.setMode("choose"), nextRouteId: () => this.session.nextRouteId }, close);
    }
    if (this.mode === "propose") return this.proposing.card(close);
    const absent = this.session.result.leftOut.get(this.absent ?? -1);
    if (absent) return leftOutCard(absent, this.acts(), close);
    if (this.mode !== "leftOut") return null;
    return leftOutList([...this.session.result.leftOut.values()], (hold) => this.showAbsent(hold), close);
  }

  /** Controls under the card of a hold or route. */
  controls(route: Route | null, hold: Hold | null): HTMLElement[] {
    if (hold) return holdControls(hold, this.acts());
    return route ? routeControls(route, this.acts()) : [];
  }

  private acts(): Acts {
    const { tables } = this.session.result;
    const names = [...tables.holds.values(), ...tables.routes.values()].map(({ colour }) => colour ?? "");
    return {
      tables,
      colours: [...new Set(names)].filter(Boolean).sort(),
      change: (...step) => this.session.change(...step),
      doubted: (row) => this.toCheck.includes(row),
      cut: () => this.setMode("cut"),
      adjustGrade: (route, way) => {
        this.setMode("propose");
        this.proposing.adjustGrade(route, way);
      },
      photos: (hold) => this.photos.strip(hold, Boolean(hold.left_out) || this.isNew(hold)),
      choose: (route, hold) => this.host.select(route, hold),
    };
  }

  private key(event: KeyboardEvent): void {
    const [field] = event.composedPath();
    if (field instanceof HTMLInputElement || field instanceof HTMLTextAreaElement) return; // have an undo of their own
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    const again = key === "y" || (key === "z" && event.shiftKey);
    if (!again && key !== "z") return;
    event.preventDefault();
    if (again) this.session.redo();
    else this.session.undo();
  }

  /** The server has answered what the log makes of the scan. */
  private shown(): void {
    const { tables, leftOut, labels } = this.session.result;
    for (const id of this.marked) if (!tables.holds.has(id)) this.marked.delete(id);
    if (this.absent !== null && !leftOut.has(this.absent)) this.cameBack(this.absent);
    const { stage } = this.host;
    stage.reserve(Math.max(0, ...tables.holds.keys(), ...leftOut.keys()));
    if (labels) stage.relabel(labels);
    this.brush.clear();
    this.showHidden();
    this.host.show(tables);
    this.then?.();
    this.then = null;
    this.host.dots(this.dots());
  }

  // Adding, cutting, bringing back ----------------------------------------------------------

  private addAt(point: Vector3): void {
    const id = this.session.nextHoldId;
    const volume = this.mode === "addVolume" ? ({ class: "volume" } as const) : {};
    this.setMode("choose");
    this.then = () => {
      const hold = this.session.result.tables.holds.get(id);
      if (hold) this.host.select(hold.route, id);
      else this.session.undo(); // nothing grew there; the server's note says why
    };
    this.session.change({ do: "add", hold: { id, at: placeOf(point) }, ...volume });
  }

  private cutAt(hit: Hit | null): boolean {
    const { hold } = this.host.chosen();
    if (!hit || !hold) return true;
    const place = placeOf(hit.point);
    if (!this.from) {
      this.from = place;
      this.host.dots([place]);
      this.host.say(say().edit.cutSecond);
      return true;
    }
    const points: [Vec3, Vec3] = [this.from, place];
    this.setMode("choose");
    this.session.change({ do: "cut", hold: refOf(hold), points, new: this.session.nextHoldId });
    return true;
  }

  private absentAt(point: Vector3): Hold | null {
    const away = ({ position: [x, y, z] }: Hold): number => Math.hypot(point.x - x, point.y - y, point.z - z);
    const near = [...this.session.result.leftOut.values()].filter((hold) => away(hold) < Math.max(NEAR, 0.6 * (hold.size_m ?? 0)));
    return near.sort((one, two) => away(one) - away(two))[0] ?? null;
  }

  private showAbsent(hold: Hold): void {
    this.host.select(null, null);
    this.absent = hold.id;
    this.host.refresh();
    this.host.look(hold.position);
  }

  private cameBack(id: number): void {
    this.absent = null;
    if (this.mode === "leftOut") this.mode = "choose";
    this.then ??= () => {
      const hold = this.session.result.tables.holds.get(id);
      if (hold) this.host.select(hold.route, id);
    };
  }

  private isNew(hold: Hold): boolean {
    return this.session.entries.some((entry) => entry.do === "add" && entry.hold.id === hold.id);
  }

  // Low confidence ------------------------------------------------------------------------

  private get toCheck(): (Hold | Route)[] {
    return lowConfidence(this.session.result.tables, this.session.entries);
  }

  private checkNext(): void {
    const all = this.toCheck;
    const { hold, route } = this.host.chosen();
    const next = all[(all.findIndex((row) => row === (hold ?? route)) + 1) % all.length];
    if (!next) return;
    this.setMode("choose");
    if ("holds" in next) this.host.select(next.id, null);
    else this.host.select(next.route, next.id);
    const place = "holds" in next ? this.session.result.tables.holds.get(next.holds[0]!)!.position : next.position;
    this.host.look(place);
  }

  // Modes -----------------------------------------------------------------------------------

  private setMode(mode: Mode): void {
    const { edit } = say();
    this.mode = this.mode === mode ? "choose" : mode;
    this.absent = null;
    this.from = null;
    this.proposing.end();
    if (this.mode !== "several") this.marked.clear();
    if (this.mode === "paint" && !this.host.chosen().hold) {
      this.mode = "choose";
      this.host.say(edit.chooseFirst);
    }
    if (["several", "leftOut", "add", "addVolume", "hide", "propose"].includes(this.mode)) this.host.select(null, null);
    const hints: Partial<Record<Mode, string>> = { hide: edit.hideHint, add: edit.addHint, addVolume: edit.addVolumeHint, cut: edit.cutFirst };
    const hint = hints[this.mode];
    if (hint) this.host.say(hint);
    const picks = this.isAiming || this.mode === "several";
    this.host.view.classList.toggle("painting", picks);
    this.host.view.classList.toggle("aiming", this.isAiming);
    this.host.draw(this.isBrush);
    if (picks) this.host.canvas.focus({ preventScroll: true });
    this.host.dots(this.dots());
    this.host.refresh();
    this.showBar();
  }

  private dots(): Vec3[] {
    return this.mode === "leftOut" ? [...this.session.result.leftOut.values()].map(({ position }) => position) : [];
  }

  // Brushes -----------------------------------------------------------------------------------

  private paint(): Paint | null {
    if (this.mode === "hide") {
      const edit = (at: Vec3, radius: number): Edit => ({ do: "hide", at, radius_m: radius });
      return { radius: this.brushSize.hide / 100, colour: HIDDEN, edit };
    }
    const hold = this.mode === "paint" ? this.host.chosen().hold : null;
    if (this.mode !== "erase" && !hold) return null;
    const edit = (at: Vec3, radius: number): Edit => ({ do: "paint", hold: hold ? refOf(hold) : NONE, at, radius_m: radius });
    return { radius: this.brushSize.paint / 100, colour: hold ? holdSwatch(hold) : "#ffffff", edit };
  }

  /** A stroke is drawn; a tap on a hidden place shows it again. */
  private stroked(stroke: Edit[]): void {
    const [first] = stroke;
    if (stroke.length === 1 && first?.do === "hide" && this.isHidden(first.at)) {
      this.session.change({ do: "unhide", at: first.at });
    } else this.session.change(...stroke);
  }

  private isHidden([x, y, z]: Vec3): boolean {
    return this.session.result.hidden.some(({ at, radius_m }) => Math.hypot(x - at[0], y - at[1], z - at[2]) <= radius_m);
  }

  private showHidden(): void {
    for (const remove of this.hidden) remove();
    const { hidden } = this.session.result;
    this.hidden = hidden.map(({ at, radius_m }) => this.host.stage.paintBall(new Vector3(...at), radius_m, HIDDEN));
  }

  private showBar(): void {
    const { canUndo, canRedo, canSave, busy, status, result } = this.session;
    const counts = { doubtful: this.toCheck.length, leftOut: result.leftOut.size };
    const brush = !this.isBrush ? null : this.mode === "hide" ? { ...HIDE, value: this.brushSize.hide } : { ...PAINT, value: this.brushSize.paint };
    this.bar.show({ mode: this.mode, brush, canUndo, canRedo, canSave, busy, status, ...counts });
  }
}

const placeOf = (point: Vector3): Vec3 => point.toArray().map((v) => Number(v.toFixed(4))) as Vec3;
