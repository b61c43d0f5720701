/** Edit mode: correct holds and routes by hand; saved beside the scan, never over its results. */

import { Vector3 } from "three";
import { h, icon } from "./dom";
import { applyEdits, emptyEdits } from "./edits";
import type { EditDocument, HoldEdit } from "./edits";
import type { Saver } from "./saver";
import type { Hit } from "./picking";
import type { Stage } from "./stage";
import type { Hold, Route, Tables, Vec3 } from "./types";
import { capital, holdSwatch, routeName } from "./words";

/** What the editor needs of the element that it edits. */
export interface EditorHost {
  readonly view: HTMLElement;
  readonly stage: Stage;
  readonly canvas: HTMLCanvasElement;
  chosen(): { route: Route | null; hold: Hold | null };
  show(tables: Tables): void;
  select(route: number | null, hold: number | null): void;
  /** Bring a hold into the middle. */
  look(hold: Hold): void;
  repaint(): void;
  say(text: string): void;
}

type Mode = "choose" | "mark" | "paint" | "erase";

const TYPES = ["jug", "crimp", "sloper", "pinch", "pocket", "foothold", "volume"];

export class Editor {
  /** Holds that are marked to become a route. */
  readonly marked = new Set<number>();
  private edits = emptyEdits();
  private past: { edits: string; undo: (() => void) | null }[] = [];
  private saved = JSON.stringify(emptyEdits());
  private saving = false;
  private mode: Mode = "choose";
  private radius = 0.03;
  private tables: Tables;
  private readonly bar = h("div", { class: "edit", role: "toolbar", "aria-label": "Edit" });
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private readonly size = h("input", { type: "range", min: 1, max: 12, value: 3, "aria-label": "Brush, cm" });
  private readonly gone = new AbortController();

  constructor(
    private readonly host: EditorHost,
    private readonly base: Tables,
    private readonly saver: Saver,
  ) {
    this.tables = base;
    this.build();
    this.listen();
  }

  async start(): Promise<void> {
    try {
      this.edits = await this.saver.read();
      this.saved = JSON.stringify(this.edits);
      this.refresh();
    } catch (error) {
      this.host.say(`Edits cannot be read: ${(error as Error).message}. Saving will not work.`);
    }
  }

  /** CSS pixels that the bar takes at the top. */
  get height(): number {
    return this.bar.offsetHeight;
  }

  dispose(): void {
    this.gone.abort();
    this.bar.remove();
  }

  /** True when the tap was the editor's. */
  tapped(hit: Hit | null): boolean {
    if (this.mode === "paint" || this.mode === "erase") return true;
    if (this.mode !== "mark") return false;
    if (hit && this.tables.holds.has(hit.hold)) {
      if (!this.marked.delete(hit.hold)) this.marked.add(hit.hold);
      this.refreshBar();
      this.host.repaint();
    }
    return true;
  }

  /** Controls under the card of a hold or route. */
  controls(route: Route | null, hold: Hold | null): HTMLElement[] {
    if (hold) return [this.holdControls(hold)];
    return route ? [this.routeControls(route)] : [];
  }

  private holdControls(hold: Hold): HTMLElement {
    const routes: [string, string][] = [...this.tables.routes.values()].map((route) => [
      String(route.id),
      routeName(route),
    ]);
    return h(
      "div",
      { class: "fields" },
      this.choice("Route", [["0", "none"], ...routes], String(hold.route ?? 0), (value) => {
        this.assign(hold, Number(value));
      }),
      this.choice("Colour", this.colours(), hold.colour ?? "", (colour) => {
        this.editHold(hold, { colour });
      }),
      this.choice("Type", TYPES.map((type) => [type, type]), hold.type ?? "", (type) => {
        this.editHold(hold, { type });
      }),
      h(
        "button",
        { class: "pill", onClick: () => this.editHold(hold, { deleted: true }) },
        "Not a hold",
      ),
      this.doubtful().includes(hold) &&
        hold.colour !== null &&
        h(
          "button",
          { class: "pill", onClick: () => this.editHold(hold, { colour: hold.colour! }) },
          "It is right",
        ),
      h("p", {}, `Certainty ${Math.round(hold.score * 100)} %`),
    );
  }

  private routeControls(route: Route): HTMLElement {
    const others: [string, string][] = [...this.tables.routes.values()]
      .filter((other) => other.id !== route.id)
      .map((other) => [String(other.id), routeName(other)]);
    const name = h("input", { "aria-label": "Name", value: route.name ?? "", maxlength: 200, placeholder: routeName(route) });
    name.addEventListener("change", () => {
      this.change((edits) => {
        edits.routes.rename = edits.routes.rename.filter((entry) => entry.route !== route.id);
        edits.routes.rename.push({ route: route.id, at: this.placeOf(route), name: name.value });
      });
    });
    return h(
      "div",
      { class: "fields" },
      h("label", {}, "Name", name),
      this.choice("Colour", this.colours(), route.colour ?? "", (colour) => {
        this.change((edits) => {
          edits.routes.colour = edits.routes.colour.filter((entry) => entry.route !== route.id);
          edits.routes.colour.push({ route: route.id, at: this.placeOf(route), colour });
        });
      }),
      this.choice("Merge with", [["", "choose …"], ...others], "", (value) => {
        const other = this.tables.routes.get(Number(value));
        if (!other) return;
        const at = [this.placeOf(route), this.placeOf(other)];
        this.change((edits) => edits.routes.merge.push({ routes: [route.id, other.id], at }));
      }),
    );
  }

  private choice(
    label: string,
    options: [string, string][],
    value: string,
    act: (value: string) => void,
  ): HTMLElement {
    const select = h("select", { "aria-label": label });
    const known = options.some(([key]) => key === value);
    for (const [key, text] of known ? options : [[value, value || "–"] as [string, string], ...options]) {
      select.append(h("option", { value: key }, capital(text)));
    }
    select.value = value;
    select.addEventListener("change", () => act(select.value));
    return h("label", {}, label, select);
  }

  private colours(): [string, string][] {
    const names = new Set([...this.base.holds.values()].map((hold) => hold.colour ?? ""));
    return [...names].filter(Boolean).sort().map((name) => [name, name]);
  }

  private placeOf(route: Route): Vec3 {
    return this.base.holds.get(route.holds[0]!)!.position;
  }

  private assign(hold: Hold, id: number): void {
    const route = this.tables.routes.get(id);
    const at = hold.position;
    this.change((edits) => {
      edits.routes.assign = edits.routes.assign.filter((entry) => entry.hold !== hold.id);
      const entry = { hold: hold.id, at, route: id };
      edits.routes.assign.push(route ? { ...entry, route_at: this.placeOf(route) } : entry);
    });
    if (!this.tables.holds.has(hold.id)) return;
    this.host.select(id || null, hold.id);
  }

  private editHold(hold: Hold, what: Partial<HoldEdit>): void {
    this.change((edits) => {
      const list = edits.holds.holds;
      const before = list.find((entry) => entry.id === hold.id);
      if (before) Object.assign(before, what);
      else list.push({ id: hold.id, at: hold.position, ...what });
    });
  }

  /** One step that can be undone. */
  private change(act: (edits: EditDocument) => void, undo: (() => void) | null = null): void {
    this.past.push({ edits: JSON.stringify(this.edits), undo });
    act(this.edits);
    this.refresh();
  }

  private undo(): void {
    const step = this.past.pop();
    if (!step) return;
    this.edits = JSON.parse(step.edits) as EditDocument;
    step.undo?.();
    this.refresh();
  }

  private async save(): Promise<void> {
    const body = JSON.stringify(this.edits);
    this.saving = true;
    this.refreshBar();
    try {
      await this.saver.save(body);
      this.saved = body;
      this.host.say("Saved. The next run of walltopo scan picks the edits up.");
    } catch (error) {
      this.host.say(`Not saved: ${(error as Error).message}`);
    }
    this.saving = false;
    this.refreshBar();
  }

  /** Holds that the scan was not sure of and that nobody has corrected, in the order of their ids. */
  private doubtful(): Hold[] {
    const seen = new Set(this.edits.holds.holds.map((edit) => edit.id));
    return [...this.tables.holds.values()].filter((hold) => hold.review && !seen.has(hold.id));
  }

  private checkNext(): void {
    const all = this.doubtful();
    const now = this.host.chosen().hold?.id ?? 0;
    const hold = all.find(({ id }) => id > now) ?? all[0];
    if (!hold) return;
    this.host.select(hold.route, hold.id);
    this.host.look(hold);
  }

  private makeRoute(): void {
    const holds = [...this.marked];
    const at = holds.map((id) => this.tables.holds.get(id)!.position);
    const route = this.tables.holds.get(holds[0]!)!.route ?? 0;
    this.marked.clear();
    this.setMode("choose");
    this.change((edits) => edits.routes.split.push({ route, holds, at }));
    this.host.select(this.tables.holds.get(holds[0]!)?.route ?? null, null);
  }

  private setMode(mode: Mode): void {
    this.mode = this.mode === mode ? "choose" : mode;
    if (this.mode !== "mark") this.marked.clear();
    if (this.mode === "paint" && !this.host.chosen().hold) {
      this.mode = "choose";
      this.host.say("Choose the hold to paint first.");
    }
    this.host.view.classList.toggle("painting", this.mode === "paint" || this.mode === "erase");
    this.refreshBar();
    this.host.repaint();
  }

  private refresh(): void {
    this.tables = applyEdits(this.base, this.edits);
    this.host.show(this.tables);
    this.refreshBar();
  }

  // Painting --------------------------------------------------------------------------------

  private listen(): void {
    const { canvas, stage } = this.host;
    const { signal } = this.gone;
    let undo: (() => void)[] = [];
    let before = "";
    let last: Vector3 | null = null;
    const paintAt = (event: PointerEvent): void => {
      const box = canvas.getBoundingClientRect();
      const hit = stage.pick(event.clientX - box.left, event.clientY - box.top);
      if (!hit || (last && last.distanceTo(hit.point) < this.radius * 0.5)) return;
      last = hit.point;
      const target = this.mode === "erase" ? null : this.host.chosen().hold;
      const at = hit.point.toArray().map((v) => Number(v.toFixed(4))) as Vec3;
      this.edits.holds.strokes.push({ hold: target?.id ?? 0, at, radius_m: this.radius });
      undo.push(stage.paintBall(hit.point, this.radius, target ? holdSwatch(target) : "#ffffff"));
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (this.mode !== "paint" && this.mode !== "erase") return;
      stage.controls.enabled = false;
      before = JSON.stringify(this.edits);
      undo = [];
      last = null;
      paintAt(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (before) paintAt(event);
    });
    const up = (): void => {
      if (!before) return;
      const steps = undo.reverse();
      this.past.push({ edits: before, undo: () => steps.forEach((step) => step()) });
      before = "";
      stage.controls.enabled = true;
      this.refreshBar();
    };
    window.addEventListener("pointerup", up, { signal });
    const leaving = (event: Event): void => {
      if (JSON.stringify(this.edits) !== this.saved) event.preventDefault();
    };
    window.addEventListener("beforeunload", leaving, { signal });
  }

  // Bar -------------------------------------------------------------------------------------

  private build(): void {
    const add = (key: string, text: string, act: () => void): HTMLButtonElement => {
      const button = h("button", { class: "pill", onClick: act }, text);
      this.buttons.set(key, button);
      this.bar.append(button);
      return button;
    };
    add("check", "Check", () => this.checkNext());
    add("undo", "Undo", () => this.undo()).prepend(icon("undo"));
    const save = add("save", "Save", () => void this.save());
    save.classList.add("main");
    save.prepend(icon("save"));
    add("mark", "Mark holds", () => this.setMode("mark"));
    add("make", "Make a route", () => this.makeRoute());
    add("paint", "Paint", () => this.setMode("paint"));
    add("erase", "Erase", () => this.setMode("erase"));
    this.size.addEventListener("input", () => (this.radius = Number(this.size.value) / 100));
    this.bar.append(this.size);
    this.host.view.append(this.bar);
    this.refreshBar();
  }

  private refreshBar(): void {
    const is = (key: string): HTMLButtonElement => this.buttons.get(key)!;
    const doubtful = this.doubtful().length;
    is("check").hidden = doubtful === 0;
    is("check").textContent = `Check ${doubtful}`;
    is("check").title = "The next hold that the scan was not sure of";
    is("undo").disabled = this.past.length === 0;
    is("save").disabled = this.saving || JSON.stringify(this.edits) === this.saved;
    this.size.hidden = this.mode !== "paint" && this.mode !== "erase";
    is("make").hidden = this.marked.size === 0;
    is("make").textContent = `Make a route of ${this.marked.size}`;
    for (const mode of ["mark", "paint", "erase"]) {
      is(mode).setAttribute("aria-pressed", String(this.mode === mode));
    }
  }
}
