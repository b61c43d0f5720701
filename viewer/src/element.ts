/** `<wall-topo src="wall.glb">`: the viewer as one element. Documented in docs/viewer.md. */

import { Box3, Vector3 } from "three";
import { holdCard, routeCard } from "./card";
import type { CardActions } from "./card";
import { h, icon } from "./dom";
import type { Shape } from "./dom";
import { readPlace, writePlace } from "./link";
import { fetchBytes, parseWall, reasonOf } from "./load";
import { Editor } from "./editor";
import { Overlay } from "./overlay";
import { Panel } from "./panel";
import { Stage } from "./stage";
import { Outline } from "./state";
import style from "./style.css?inline";
import { listenForTaps } from "./tap";
import type { Hold, Route, Tables } from "./types";
import { holdName, metres, routeName } from "./words";

const EMPTY: Tables = { title: "", metric: true, holds: new Map(), routes: new Map() };

export class WallTopo extends HTMLElement {
  static readonly observedAttributes = ["src", "theme"];

  protected stage: Stage | null = null;
  protected tables: Tables = EMPTY;
  protected readonly panel = new Panel();
  protected overlay!: Overlay;
  protected readonly view = h("div", { class: "view" });
  private readonly root: ShadowRoot;
  private readonly canvas = h("canvas", {
    tabindex: 0,
    role: "img",
    "aria-label":
      "The wall in 3D. Arrow keys turn, plus and minus zoom, brackets step through the routes.",
  });
  private readonly card = h("section", { class: "card", hidden: true, "aria-label": "Chosen" });
  private readonly toast = h("div", { class: "toast", role: "status" });
  private readonly message = h("div", { class: "message" });
  private readonly tools = new Map<string, HTMLButtonElement>();
  private route: number | null = null;
  private hold: number | null = null;
  private measuring = false;
  private editor: Editor | null = null;
  private loading: AbortController | null = null;
  private resizer: ResizeObserver | null = null;
  private toastTimer = 0;
  private linkTimer = 0;
  private readonly dark = matchMedia("(prefers-color-scheme: dark)");
  private readonly onScheme = (): void => this.applyTheme();
  private readonly onHash = (): void => this.applyPlace(true);

  constructor() {
    super();
    this.root = this.attachShadow({ mode: "open" });
    const sheet = h("style");
    sheet.textContent = style;
    this.root.append(sheet);
  }

  connectedCallback(): void {
    try {
      this.stage = new Stage(this.canvas);
    } catch {
      this.build();
      this.fail("This browser cannot draw in 3D (WebGL 2 is missing or switched off).");
      return;
    }
    this.build();
    this.wire(this.stage);
    this.applyTheme();
    void this.load();
  }

  disconnectedCallback(): void {
    this.loading?.abort();
    this.resizer?.disconnect();
    this.dark.removeEventListener("change", this.onScheme);
    window.removeEventListener("hashchange", this.onHash);
    this.stage?.dispose();
    this.stage = null;
  }

  attributeChangedCallback(name: string, before: string | null, after: string | null): void {
    if (!this.stage || before === after) return;
    if (name === "src") void this.load();
    if (name === "theme") this.applyTheme();
  }

  // The JS API -----------------------------------------------------------------------------

  /** The routes, as in `routes.json`. */
  get routes(): Route[] {
    return [...this.tables.routes.values()];
  }

  /** The holds, as in `holds.json`. */
  get holds(): Hold[] {
    return [...this.tables.holds.values()];
  }

  /** Id of the lit route, or null. */
  get selectedRoute(): number | null {
    return this.route;
  }

  /** Id of the chosen hold, or null. */
  get selectedHold(): number | null {
    return this.hold;
  }

  /** Light up a route (null: show all); `move` turns the camera to it. */
  selectRoute(id: number | null, options: { move?: boolean } = {}): void {
    this.choose(id !== null && this.tables.routes.has(id) ? id : null, null);
    const route = this.route === null ? null : this.tables.routes.get(this.route)!;
    if (options.move && route) this.lookAt(route);
  }

  /** Choose a hold and light up its route. */
  selectHold(id: number | null): void {
    const hold = id === null ? undefined : this.tables.holds.get(id);
    this.choose(hold ? hold.route : this.route, hold ? hold.id : null);
  }

  /** The whole wall, from the front. */
  home(): void {
    this.stage?.home(true);
  }

  /** From where a climber stands, looking at the chosen route (or the whole wall). */
  climberView(): void {
    const stage = this.stage;
    if (!stage?.front) return;
    const route = this.route === null ? undefined : this.tables.routes.get(this.route);
    const { floor, box, direction } = stage.front;
    const places = this.placesOf(route?.holds ?? []);
    const start = this.placesOf(route?.start ?? route?.holds.slice(0, 1) ?? []);
    const unit = this.tables.metric ? 1 : Math.max(box.max.z - box.min.z, 1e-6) / 4;
    const all = places.isEmpty() ? box : places;
    const at = (start.isEmpty() ? box : start).getCenter(new Vector3());
    const middle = all.getCenter(new Vector3());
    const eye = at.clone().addScaledVector(direction, 3.2 * unit);
    eye.z = floor + 1.65 * unit;
    middle.z = Math.max(eye.z - 0.2 * unit, middle.z);
    stage.moveTo(eye, middle, true);
  }

  /** The picture as a PNG blob. */
  screenshot(): Promise<Blob | null> {
    return this.stage ? this.stage.screenshot() : Promise.resolve(null);
  }

  /** The address of this page with route, hold and camera in it. */
  link(): string {
    const url = new URL(location.href);
    url.hash = writePlace({ route: this.route, hold: this.hold, camera: this.cameraNow() });
    return url.href;
  }

  /** Where a hold or point is drawn, in CSS pixels of the element's canvas. */
  project(place: number | [number, number, number]): { x: number; y: number; ahead: boolean } | null {
    const point = typeof place === "number" ? this.tables.holds.get(place)?.position : place;
    return point && this.stage ? this.stage.project(point) : null;
  }

  /** The hold drawn at a point of the canvas (0: the wall), or null where nothing is. */
  pickAt(x: number, y: number): number | null {
    return this.stage?.pick(x, y)?.hold ?? null;
  }

  // Loading ---------------------------------------------------------------------------------

  private async load(): Promise<void> {
    const source = this.getAttribute("src");
    if (!source) return this.fail("No model was given: set the src attribute.");
    this.loading?.abort();
    const { signal } = (this.loading = new AbortController());
    this.removeAttribute("data-ready");
    const bar = h("i");
    this.message.replaceChildren(h("div", { class: "bar" }, bar), h("p", {}, "Loading the wall …"));
    this.message.hidden = false;
    try {
      const bytes = await fetchBytes(source, (share) => {
        bar.style.width = `${Math.round(share * 100)}%`;
      }, signal);
      const wall = await parseWall(bytes, this.getAttribute("heading") ?? "Wall");
      if (signal.aborted || !this.stage) return;
      this.tables = wall.tables;
      if (this.hasAttribute("heading")) this.tables.title = this.getAttribute("heading")!;
      this.stage.show(wall, false);
      this.loaded();
    } catch (error) {
      if (!signal.aborted) this.fail(`The wall could not be loaded: ${reasonOf(error)}.`);
      return;
    }
    await this.refine(signal);
  }

  private loaded(): void {
    this.panel.fill(this.tables);
    this.choose(null, null);
    this.message.hidden = true;
    this.stage!.home(false);
    this.applyPlace(false);
    if (this.hasAttribute("edit")) this.startEditor();
    this.setAttribute("data-ready", "first");
    this.emit("wall-load", { routes: this.tables.routes.size, holds: this.tables.holds.size });
  }

  private startEditor(): void {
    const address = this.getAttribute("edit") || "api/edits";
    const host = {
      view: this.view,
      stage: this.stage!,
      canvas: this.canvas,
      chosen: () => ({
        route: this.tables.routes.get(this.route ?? -1) ?? null,
        hold: this.tables.holds.get(this.hold ?? -1) ?? null,
      }),
      show: (tables: Tables) => {
        this.tables = tables;
        this.panel.fill(tables);
        const hold = this.hold !== null && tables.holds.has(this.hold) ? this.hold : null;
        const route = hold === null ? this.route : tables.holds.get(hold)!.route;
        this.choose(route !== null && tables.routes.has(route) ? route : null, hold);
      },
      select: (route: number | null, hold: number | null) => this.choose(route, hold),
      repaint: () => this.repaint(),
      say: (text: string) => this.say(text),
    };
    this.editor = new Editor(host, this.tables, address);
    void this.editor.start();
  }

  /** The finer tier, once the first one stands. It is a bonus: if it fails, say so and go on. */
  private async refine(signal: AbortSignal): Promise<void> {
    const source = this.getAttribute("detail");
    if (!source) return;
    try {
      const wall = await parseWall(await fetchBytes(source, () => {}, signal), "");
      if (signal.aborted || !this.stage) return;
      this.stage.show(wall, true);
      this.setAttribute("data-ready", "detail");
    } catch (error) {
      if (!signal.aborted) this.say(`The finer model did not load: ${reasonOf(error)}`);
    }
  }

  private fail(text: string): void {
    this.message.replaceChildren(h("strong", {}, "Sorry"), h("p", { role: "alert" }, text));
    this.message.hidden = false;
    this.setAttribute("data-ready", "error");
    this.emit("wall-error", { message: text });
  }

  // Choosing --------------------------------------------------------------------------------

  protected choose(route: number | null, hold: number | null): void {
    const changed = route !== this.route || hold !== this.hold;
    this.route = route;
    this.hold = hold;
    this.repaint();
    this.panel.activate(route);
    this.showCard();
    if (!changed) return;
    this.saveLink();
    if (hold !== null) this.emit("hold-select", { hold: this.tables.holds.get(hold) });
    this.emit("route-select", { route: route === null ? null : this.tables.routes.get(route) });
    const name = route === null ? "" : routeName(this.tables.routes.get(route)!);
    const what = hold === null ? "" : holdName(this.tables.holds.get(hold)!);
    this.announce([what, name].filter(Boolean).join(", ") || "All routes");
  }

  protected repaint(): void {
    const route = this.route === null ? undefined : this.tables.routes.get(this.route);
    const outlines = new Map<number, number>();
    for (const id of route?.holds ?? []) outlines.set(id, Outline.route);
    if (this.hold !== null) outlines.set(this.hold, Outline.chosen);
    for (const id of this.editor?.marked ?? []) outlines.set(id, Outline.marked);
    const lit = route ? new Set([...route.holds, ...(this.hold === null ? [] : [this.hold])]) : null;
    this.stage?.paint(lit, outlines);
    this.overlay.flags(route ?? null, this.tables);
  }

  private showCard(): void {
    const act: CardActions = {
      previous: () => this.step(-1),
      next: () => this.step(1),
      climber: () => this.climberView(),
      close: () => this.choose(this.hold !== null && this.route !== null ? this.route : null, null),
      route: (id) => this.selectRoute(id),
    };
    const hold = this.hold === null ? undefined : this.tables.holds.get(this.hold);
    const route = this.route === null ? undefined : this.tables.routes.get(this.route);
    const parts = hold
      ? holdCard(hold, this.tables, act)
      : route
        ? routeCard(route, this.tables, act)
        : [];
    if (this.editor) parts.push(...this.editor.controls(route ?? null, hold ?? null));
    this.card.replaceChildren(...parts);
    this.card.hidden = parts.length === 0;
  }

  private step(by: number): void {
    const shown = this.panel.shown();
    if (shown.length === 0) return;
    const at = shown.findIndex((route) => route.id === this.route);
    const next = at < 0 ? (by > 0 ? 0 : shown.length - 1) : (at + by + shown.length) % shown.length;
    this.selectRoute(shown[next]!.id, { move: true });
  }

  private placesOf(ids: number[]): Box3 {
    const box = new Box3();
    for (const id of ids) {
      const hold = this.tables.holds.get(id);
      if (hold) box.expandByPoint(new Vector3(...hold.position));
    }
    return box;
  }

  private lookAt(route: Route): void {
    const stage = this.stage;
    const box = this.placesOf(route.holds);
    if (!stage?.front || box.isEmpty()) return;
    const way = new Vector3();
    for (const id of route.holds) {
      const normal = this.tables.holds.get(id)?.normal;
      if (normal) way.add(new Vector3(...normal).setZ(0));
    }
    const direction = way.length() > 1e-6 ? way.normalize().add(stage.front.direction) : stage.front.direction;
    const room = Math.max(0.12 * box.getSize(new Vector3()).length(), 1e-3);
    const places = route.holds.flatMap((id) => {
      const place = this.tables.holds.get(id)?.position;
      return place ? [-room, room].map((d) => new Vector3(...place).addScalar(d)) : [];
    });
    const covered = this.card.hidden ? 0 : (this.card.offsetHeight + 10) / this.view.clientHeight;
    stage.frame(places, direction, true, { margin: 1.3, covered: Math.min(0.5, covered) });
  }

  // Page ------------------------------------------------------------------------------------

  protected build(): void {
    if (this.stage) this.overlay = new Overlay(this.stage);
    const bar = h("div", { class: "tools", role: "toolbar", "aria-label": "View" });
    const add = (key: string, label: string, shape: Shape, act: () => void): void => {
      const button = h("button", { class: "tool", "aria-label": label, title: label }, icon(shape));
      button.addEventListener("click", act);
      this.tools.set(key, button);
      bar.append(button);
    };
    add("home", "Whole wall (H)", "home", () => this.home());
    add("climber", "View as a climber (C)", "climber", () => this.climberView());
    add("measure", "Measure (M)", "measure", () => this.toggleMeasure());
    add("share", "Copy a link to this view", "share", () => void this.share());
    add("picture", "Save a picture", "camera", () => void this.savePicture());
    this.tools.get("measure")!.setAttribute("aria-pressed", "false");
    this.view.replaceChildren(this.canvas, bar, this.card, this.toast, this.message);
    if (this.stage) this.canvas.after(this.overlay.root);
    const shell = h("div", { class: "shell" }, this.panel.root, this.view);
    this.root.querySelector(".shell")?.remove();
    this.root.append(shell);
    this.panel.onRoute = (id) => this.selectRoute(id, { move: true });
  }

  private wire(stage: Stage): void {
    stage.onFrame = () => this.overlay.update();
    stage.onLost = (lost) => this.say(lost ? "The graphics were interrupted …" : "Restored.");
    stage.controls.addEventListener("rest", () => this.saveLink());
    this.resizer = new ResizeObserver(() => {
      stage.resize(this.view.clientWidth, this.view.clientHeight);
    });
    this.resizer.observe(this.view);
    stage.resize(this.view.clientWidth, this.view.clientHeight);
    listenForTaps(this.canvas, {
      tap: (x, y) => this.tapped(x, y),
      double: (x, y) => this.focusOn(x, y),
    });
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.dark.addEventListener("change", this.onScheme);
    if (this.hasAttribute("links")) window.addEventListener("hashchange", this.onHash);
  }

  protected tapped(x: number, y: number): void {
    const hit = this.stage!.pick(x, y);
    if (this.measuring) {
      if (!hit) return;
      const length = this.overlay.measure(hit.point, this.tables.metric);
      this.stage!.redraw();
      this.say(length ?? "Tap the second point.");
      if (length) this.emit("measure", { text: length });
      return;
    }
    if (this.editor?.tapped(hit)) return;
    if (hit && hit.hold > 0 && this.tables.holds.has(hit.hold)) this.selectHold(hit.hold);
    else this.choose(null, null);
  }

  private focusOn(x: number, y: number): void {
    const stage = this.stage!;
    const hit = stage.pick(x, y);
    if (!hit || this.measuring || !stage.front) return;
    const near = stage.front.box.getSize(new Vector3()).length() * 0.14;
    const way = stage.camera.position.clone().sub(hit.point);
    const distance = Math.min(way.length() * 0.5, Math.max(near, way.length() * 0.25));
    stage.moveTo(hit.point.clone().addScaledVector(way.normalize(), distance), hit.point, true);
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { controls } = this.stage!;
    const acts: Record<string, () => void> = {
      ArrowLeft: () => void controls.rotate(-0.15, 0, true),
      ArrowRight: () => void controls.rotate(0.15, 0, true),
      ArrowUp: () => void controls.rotate(0, -0.1, true),
      ArrowDown: () => void controls.rotate(0, 0.1, true),
      "+": () => void controls.dolly(controls.distance * 0.2, true),
      "=": () => void controls.dolly(controls.distance * 0.2, true),
      "-": () => void controls.dolly(-controls.distance * 0.25, true),
      "[": () => this.step(-1),
      "]": () => this.step(1),
      Escape: () => (this.measuring ? this.toggleMeasure() : this.choose(null, null)),
      h: () => this.home(),
      c: () => this.climberView(),
      m: () => this.toggleMeasure(),
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  private toggleMeasure(): void {
    this.measuring = !this.measuring;
    this.tools.get("measure")!.setAttribute("aria-pressed", String(this.measuring));
    this.view.classList.toggle("measuring", this.measuring);
    this.overlay.clearMeasure();
    this.stage?.redraw();
    if (this.measuring) this.say("Tap two points on the wall.");
  }

  private async share(): Promise<void> {
    const url = this.link();
    try {
      await navigator.clipboard.writeText(url);
      this.say("Link copied.");
    } catch {
      // Without the clipboard (page from disk, old browser) the address itself is the link.
      history.replaceState(null, "", url);
      this.say("The link to this view is in the address bar.");
    }
  }

  private async savePicture(): Promise<void> {
    const blob = await this.screenshot();
    if (!blob) return this.say("The picture could not be made.");
    const link = h("a", { href: URL.createObjectURL(blob), download: "wall.png" });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  private applyTheme(): void {
    const wish = this.getAttribute("theme");
    const dark = wish === "dark" || (wish !== "light" && this.dark.matches);
    this.classList.toggle("dark", dark);
    this.stage?.backdrop(dark ? "#15171b" : "#eef0f3");
  }

  private cameraNow(): number[] | null {
    if (!this.stage) return null;
    const { controls } = this.stage;
    const eye = controls.getPosition(new Vector3());
    const target = controls.getTarget(new Vector3());
    return [...eye.toArray(), ...target.toArray()];
  }

  private applyPlace(animate: boolean): void {
    if (!this.hasAttribute("links") || !this.stage) return;
    const place = readPlace(location.hash);
    if (place.hold !== null && this.tables.holds.has(place.hold)) this.selectHold(place.hold);
    else if (place.route !== null) this.selectRoute(place.route, { move: place.camera === null });
    if (!place.camera) return;
    const [a, b, c, d, e, f] = place.camera as [number, number, number, number, number, number];
    this.stage.moveTo(new Vector3(a, b, c), new Vector3(d, e, f), animate);
  }

  private saveLink(): void {
    if (!this.hasAttribute("links") || !this.hasAttribute("data-ready")) return;
    clearTimeout(this.linkTimer);
    this.linkTimer = window.setTimeout(() => {
      const hash = writePlace({ route: this.route, hold: this.hold, camera: this.cameraNow() });
      history.replaceState(null, "", hash || location.pathname + location.search);
    }, 300);
  }

  protected say(text: string): void {
    this.toast.textContent = text;
    this.toast.classList.add("on");
    clearTimeout(this.toastTimer);
    this.toastTimer = window.setTimeout(() => this.toast.classList.remove("on"), 3500);
  }

  private announce(text: string): void {
    // Heard by screen readers, not shown: the card shows it already.
    this.toast.classList.remove("on");
    this.toast.textContent = text;
  }

  protected emit(name: string, detail: unknown): void {
    this.dispatchEvent(new CustomEvent(name, { detail, bubbles: true, composed: true }));
  }

  protected length(value: number): string {
    return metres(value, this.tables.metric);
  }
}
