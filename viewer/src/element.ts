/** `<wall-topo src="wall.glb">`: the viewer as one element. Documented in docs/viewer.md. */

import { Vector3 } from "three";
import type { Insets } from "./camera/fit";
import { CameraViews } from "./camera/views";
import type { Hold, Route, Tables, Vec3 } from "./data/types";
import type { ClimberRow } from "./data/wire";
import { Editor } from "./edit/editor";
import { Server } from "./edit/server";
import { GestureCapture, grabMode } from "./input/gesture_capture";
import { handleKey } from "./input/keyboard";
import { listenForTaps } from "./input/taps";
import { say, speak } from "./languages";
import { holdName, routeFacts, routeName, swatch, wallFacts } from "./languages/format";
import { readMoves } from "./moves/moves_file";
import type { Moves, Person } from "./moves/moves_file";
import { Player } from "./moves/player";
import { holdCard, routeCard } from "./panels/cards";
import type { CardActions } from "./panels/cards";
import { h } from "./panels/dom";
import { Layout } from "./panels/layout";
import { Placeholder } from "./panels/placeholder";
import { RouteList } from "./panels/route_list";
import { Toast } from "./panels/toast";
import { Toolbar } from "./panels/toolbar";
import { Heatmap } from "./scene/heatmap";
import type { HeatmapLegend } from "./scene/heatmap";
import { Outline } from "./scene/hold_state";
import { Overlay } from "./scene/overlay";
import { Stage } from "./scene/stage";
import { composePicture } from "./sharing/picture";
import type { Caption } from "./sharing/picture";
import { AddressBar, copyLink, download, linkTo } from "./sharing/share";
import { parseView } from "./sharing/view_link";
import type { LinkedView } from "./sharing/view_link";
import style from "./style.css?inline";
import { preload, takePreload } from "./tiers/preload";
import { readWall, reasonOf } from "./tiers/read_wall";
import type { WallModel } from "./tiers/read_wall";
import { WorkerClient } from "./tiers/worker_client";
import { yieldToPage } from "./tiers/yield_to_page";

/** Holds of a climb that is no route of the scan, by id: all of them, and those with a flag. */
export interface HoldSet {
  holds: number[];
  start: number[];
  top: number[];
  feet: number[];
}

const EMPTY: Tables = { title: "", metric: true, holds: new Map(), routes: new Map() };

export class WallTopo extends HTMLElement {
  static readonly observedAttributes = ["src", "theme", "grab"];

  private stage: Stage | null = null;
  private views: CameraViews | null = null;
  private tables: Tables = EMPTY;
  private panel = new RouteList();
  private overlay: Overlay | null = null;
  private grab: GestureCapture | null = null;
  private readonly shell = h("div", { class: "shell" });
  private readonly view = h("div", { class: "view", part: "view" });
  private readonly bar = new Toolbar();
  private readonly root: ShadowRoot;
  private canvas = h("canvas");
  private readonly card = h("section", { class: "card", part: "card", hidden: true });
  private readonly arrangement = new Layout({
    element: this,
    shell: this.shell,
    view: this.view,
    bar: this.bar.root,
    card: this.card,
  });
  private readonly toast = new Toast();
  private readonly heat = new Heatmap();
  private readonly message = new Placeholder();
  private readonly thread = h("div", { class: "thread", hidden: true }, h("i"));
  private route: number | null = null;
  private hold: number | null = null;
  /** Holds that the page shows in the stead of a route. */
  private set: HoldSet | null = null;
  /** Dashed lines that the page shows on the wall. */
  private lines: Vec3[][] = [];
  private touched: Vector3 | null = null;
  private isMeasuring = false;
  private editor: Editor | null = null;
  /** How routes may go, where the scan has it; and the one that is shown. */
  private moves: Moves | null = null;
  private player: Player | null = null;
  /** Reads the tiers; started before they have come. */
  private reader: WorkerClient | null = null;
  private loading: AbortController | null = null;
  private gone = new AbortController();
  private preferredHeight: "low" | "half" | "full" = "half";
  private readonly address = new AddressBar();
  private readonly dark = matchMedia("(prefers-color-scheme: dark)");

  constructor() {
    super();
    this.root = this.attachShadow({ mode: "open" });
    // A constructed sheet: a content policy may forbid inline styles.
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    this.root.adoptedStyleSheets = [sheet];
  }

  connectedCallback(): void {
    this.gone = new AbortController();
    const { code, words } = speak([this.lang, ...navigator.languages]);
    this.shell.lang = code;
    // A canvas whose context was given back cannot draw again: each life has its own.
    this.canvas = h("canvas", { tabindex: 0, role: "img", part: "canvas", "aria-label": words.picture });
    if (this.getAttribute("loading") === "lazy") this.whenNear(() => void this.begin());
    else void this.begin();
  }

  /** Once the element is within a screen of what is seen; until then it only shows its poster. */
  private whenNear(begin: () => void): void {
    this.shell.replaceChildren(this.message.root);
    this.root.append(this.shell);
    this.message.idle(this.getAttribute("heading"), this.getAttribute("poster"));
    const watcher = new IntersectionObserver(
      (seen) => {
        if (!seen.some(({ isIntersecting }) => isIntersecting)) return;
        watcher.disconnect();
        begin();
      },
      { rootMargin: "100%" },
    );
    watcher.observe(this);
    this.gone.signal.addEventListener("abort", () => watcher.disconnect());
  }

  private async begin(): Promise<void> {
    const { signal } = this.gone;
    this.build();
    await yieldToPage();
    if (signal.aborted) return;
    const source = this.getAttribute("src");
    const coming = this.come(); // read while the stage is built
    await yieldToPage();
    if (signal.aborted) return;
    try {
      this.stage = new Stage(this.canvas);
    } catch {
      return this.fail(say().words.noWebGl);
    }
    this.overlay = new Overlay(this.stage);
    this.canvas.after(this.overlay.root);
    this.wire(this.stage);
    this.applyTheme();
    await this.load(this.getAttribute("src") === source ? coming : undefined);
  }

  disconnectedCallback(): void {
    this.gone.abort();
    this.loading?.abort();
    this.address.dispose();
    this.editor?.dispose();
    this.editor = null;
    this.stopMoves();
    this.reader?.end();
    this.stage?.dispose();
    this.stage = null;
    this.views = null;
  }

  attributeChangedCallback(name: string, before: string | null, after: string | null): void {
    if (!this.stage || before === after) return;
    if (name === "src") void this.load();
    if (name === "theme") this.applyTheme();
    if (name === "grab") this.chooseGrab();
  }

  // The JS API -----------------------------------------------------------------------------

  /** Begin to read a wall that an element will soon show; `src` as that one will have it, with a `heading` of its own. */
  static expect(src: string): void {
    preload(src);
  }

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

  /** Whether taps measure a distance; each second tap emits `measure`. */
  get measuring(): boolean {
    return this.isMeasuring;
  }

  set measuring(on: boolean) {
    this.isMeasuring = on;
    this.bar.press(this.isMeasuring);
    this.view.classList.toggle("measuring", this.isMeasuring);
    this.overlay?.clearMeasure();
    this.stage?.redraw();
    if (this.isMeasuring) this.say(say().words.twoPoints);
  }

  /** Light up a route (null: show all); `move` turns the camera to it. */
  selectRoute(id: number | null, options: { move?: boolean } = {}): void {
    this.choose(id !== null && this.tables.routes.has(id) ? id : null, null);
    const route = this.route === null ? null : this.tables.routes.get(this.route)!;
    if (options.move && route) this.views?.route(route, this.tables, true, this.player?.places);
  }

  /** Show only these routes, in the list and on the wall, where the others fade; null: all. */
  showRoutes(ids: Iterable<number> | null): void {
    this.panel.limit(ids);
    this.repaint();
  }

  /**
   * Colour the holds of routes by a value from 0 to 1, by route id; the rest fades. With `words` a legend says what
   * the ends stand for. null: as photographed.
   */
  showHeat(values: Iterable<[number, number]> | null, words: HeatmapLegend | null = null): void {
    this.heat.set(values, words);
    this.repaint();
  }

  /**
   * Light up these holds in the stead of a route, with flags, while taps emit `hold-tap` and choose nothing; `move`
   * turns the camera to them. null: routes again.
   */
  showHolds(set: HoldSet | null, options: { move?: boolean } = {}): void {
    if (set && !this.set) this.choose(null, null);
    this.set = set;
    this.repaint();
    if (options.move && set?.holds.length) this.views?.route(set, this.tables);
  }

  /** Draw dashed lines on the wall, each through places in the scan's frame; an empty list: none. */
  showLines(lines: Vec3[][]): void {
    this.lines = lines;
    this.repaint();
  }

  /** Choose a hold and light up its route. */
  selectHold(id: number | null): void {
    const hold = id === null ? undefined : this.tables.holds.get(id);
    this.choose(hold ? hold.route : this.route, hold ? hold.id : null);
  }

  /**
   * A figure climbs the selected route, as the file of the attribute `moves` has it, which is read now if it was not
   * before. It is the climber who reaches about as high as `person`. Returns that climber; null where no moves are
   * known.
   */
  async showMoves(person: Person | null = null): Promise<ClimberRow | null> {
    const signal = this.loading?.signal;
    if (!this.moves && signal) await this.askMoves(signal);
    if (signal?.aborted) return null;
    const player = this.climbRoute(person);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) player?.play();
    return player?.shown ?? null;
  }

  /** The figure goes, and the card of the route comes back. */
  hideMoves(): void {
    if (!this.player) return;
    this.stopMoves();
    this.showCard();
  }

  /** The whole wall, from the framing. */
  home(): void {
    this.views?.wall(true);
  }

  /** From where a climber stands, looking at the chosen route (or the whole wall). */
  climberView(): void {
    this.views?.climber(this.tables.routes.get(this.route ?? -1), this.tables);
  }

  /** The whole wall from one side (-1), the front (0), the other side (1), or between: for a wall that turns. */
  swing(share: number): void {
    this.views?.swing(share);
  }

  /** The drawn wall as a PNG blob, without text. */
  screenshot(): Promise<Blob | null> {
    return this.stage ? this.stage.screenshot() : Promise.resolve(null);
  }

  /** A PNG blob to share: the drawn wall with flags at start and top, and a caption. */
  async picture(): Promise<Blob | null> {
    const drawn = await this.screenshot();
    if (!drawn || !this.overlay) return null;
    return composePicture(drawn, this.canvas.clientWidth, this.overlay.flagged, this.caption());
  }

  private caption(): Caption {
    const { title, metric } = this.tables;
    const route = this.tables.routes.get(this.route ?? -1);
    if (!route) return { name: title, facts: wallFacts(this.tables), swatch: null };
    const facts = [routeFacts(route, metric), title].filter(Boolean).join(" · ");
    return { name: routeName(route), facts, swatch: swatch(route, this.tables) };
  }

  /** The address of this page with route, hold and camera in it. */
  link(): string {
    return linkTo(this.place);
  }

  /** Eye and target, six numbers in the scan's frame; null before a wall stands. */
  get camera(): number[] | null {
    if (!this.stage?.framing) return null;
    const { controls } = this.stage;
    const eye = controls.getPosition(new Vector3());
    const target = controls.getTarget(new Vector3());
    return [...eye.toArray(), ...target.toArray()];
  }

  /** The position of a hold or point on the element's canvas, in CSS pixels. */
  project(place: number | [number, number, number]): { x: number; y: number; ahead: boolean } | null {
    const point = typeof place === "number" ? this.tables.holds.get(place)?.position : place;
    return point && this.stage ? this.stage.project(point) : null;
  }

  /** The hold drawn at a point of the canvas (0: the wall), or null where nothing is. */
  pickAt(x: number, y: number): number | null {
    return this.stage?.pick(x, y)?.hold ?? null;
  }

  // Loading ---------------------------------------------------------------------------------

  /** Ask for the wall; null where the page names none. */
  private come(): Promise<WallModel> | null {
    const source = this.getAttribute("src");
    this.loading?.abort();
    this.reader?.end();
    const ahead = takePreload(source ?? "");
    this.reader = ahead?.reader ?? new WorkerClient();
    const { signal } = (this.loading = ahead?.stop ?? new AbortController());
    this.removeAttribute("data-ready");
    if (!source) return null;
    const progress = this.message.waiting(this.getAttribute("heading"), this.getAttribute("poster"));
    if (ahead) {
      ahead.progress = progress;
      return ahead.coming;
    }
    const title = this.getAttribute("heading") ?? say().words.wall;
    const coming = readWall(this.reader!, source, { progress, title, signal });
    coming.catch(() => {}); // `load` tells it, once it is there to wait
    return coming;
  }

  private async load(coming = this.come()): Promise<void> {
    if (!coming) return this.fail(say().words.noSource);
    const { signal } = this.loading!;
    let finer: Promise<WallModel> | null = null;
    try {
      const wall = await coming;
      if (signal.aborted || !this.stage) return;
      this.tables = wall.tables;
      if (this.hasAttribute("heading")) this.tables.title = this.getAttribute("heading")!;
      await this.stage.prepare(wall, this.reader!, signal);
      if (signal.aborted) return;
      finer = this.finer(signal); // read while the first tier is drawn
      await yieldToPage();
      this.panel.fill(this.tables);
      await yieldToPage();
      if (signal.aborted) return;
      this.stage.show(wall, false);
      await yieldToPage();
      if (signal.aborted) return;
      this.lay();
      this.loaded(this.stage);
    } catch (error) {
      if (!signal.aborted) this.fail(say().failed(reasonOf(error)));
      return;
    }
    if (finer) await this.refine(finer, signal);
  }

  private finer(signal: AbortSignal): Promise<WallModel> | null {
    const source = this.getAttribute("detail");
    if (!source) return null;
    this.thread.hidden = false;
    const line = this.thread.querySelector("i")!;
    const progress = (share: number): void => void (line.style.width = `${share * 100}%`);
    const coming = readWall(this.reader!, source, { progress, signal });
    coming.catch(() => {}); // `refine` tells it
    return coming;
  }

  /** Everything around the picture, once the wall is known. */
  private lay(): void {
    this.panel.sheet.set(this.tables.routes.size > 0 && this.arrangement.roomy ? "half" : "low");
    this.message.hide();
    this.arrange();
    this.choose(null, null);
    this.views!.wall(false);
    this.applyPlace(false);
  }

  private loaded(stage: Stage): void {
    if (this.hasAttribute("edit")) this.startEditor();
    else void this.askMoves(this.loading!.signal);
    stage.drawNow();
    this.setAttribute("data-ready", "first");
    this.emit("wall-load", { routes: this.tables.routes.size, holds: this.tables.holds.size });
  }

  private async askMoves(signal: AbortSignal): Promise<void> {
    const source = this.getAttribute("moves");
    this.stopMoves();
    this.moves = source ? await readMoves(source, this.tables, signal) : null;
    if (!signal.aborted && this.moves) this.showCard();
  }

  /** A figure that climbs the chosen route; gives its player, or null where no moves are known. */
  private climbRoute(person: Person | null = null): Player | null {
    const one = this.moves?.routes.get(this.route ?? -1);
    if (!this.stage || !this.moves || !one?.climbers.some(({ moves }) => moves.length > 0)) {
      this.stopMoves();
      return null;
    }
    this.player?.dispose();
    this.player = new Player(this.stage, this.tables, one, this.moves.unit, {
      close: () => this.hideMoves(),
      person,
      shows: (climber) => this.emit("moves-show", { climber }),
    });
    this.showCard();
    return this.player;
  }

  private stopMoves(): void {
    if (!this.player) return;
    this.player.dispose();
    this.player = null;
    this.emit("moves-show", { climber: null });
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
      look: (place: Vec3) => this.views?.closer(new Vector3(...place)),
      refresh: () => {
        this.repaint();
        this.showCard();
      },
      dots: (places: Vec3[]) => {
        this.overlay?.mark(places);
        this.stage?.redraw();
      },
      frame: (route: Route) => this.views?.route(route, this.tables),
      say: (text: string) => this.say(text),
    };
    this.editor?.dispose();
    this.shell.classList.add("editing");
    const token = this.getAttribute("token") ?? "";
    this.editor = new Editor(host, this.tables, new Server(address, token));
    void this.editor.start();
    this.views?.refit(false);
  }

  /** The finer tier, once the first one stands. It is a bonus: if it fails, say so and go on. */
  private async refine(coming: Promise<WallModel>, signal: AbortSignal): Promise<void> {
    try {
      const wall = await coming;
      if (signal.aborted || !this.stage) return;
      await this.stage.prepare(wall, this.reader!, signal);
      if (signal.aborted) return;
      this.stage.show(wall, true);
      this.stage.drawNow();
      this.setAttribute("data-ready", "detail");
    } catch (error) {
      if (!signal.aborted) this.say(say().finerFailed(reasonOf(error)));
    } finally {
      if (!signal.aborted) this.thread.hidden = true;
    }
  }

  /** The GPU lost the pictures: they are read once more from the file of what is shown. */
  private async refill(stage: Stage): Promise<void> {
    const { signal } = this.loading!;
    const reader = this.reader!;
    try {
      await stage.refill(await readWall(reader, stage.shown!, { signal }), reader, signal);
    } catch (error) {
      if (!signal.aborted) this.fail(say().failed(reasonOf(error)));
    }
  }

  private fail(text: string): void {
    this.message.failed(text, this.stage ? () => location.reload() : null);
    this.setAttribute("data-ready", "error");
    this.emit("wall-error", { message: text });
  }

  // Choosing --------------------------------------------------------------------------------

  private choose(route: number | null, hold: number | null): void {
    const changed = route !== this.route || hold !== this.hold;
    if (route !== this.route || hold !== null) this.stopMoves();
    this.route = route;
    this.hold = hold;
    this.repaint();
    this.showCard();
    this.panel.activate(route);
    this.follow();
    if (!changed) return;
    this.saveLink();
    if (hold !== null) this.emit("hold-select", { hold: this.tables.holds.get(hold) });
    this.emit("route-select", { route: route === null ? null : this.tables.routes.get(route) });
    const name = route === null ? "" : routeName(this.tables.routes.get(route)!);
    const what = hold === null ? "" : holdName(this.tables.holds.get(hold)!);
    this.toast.announce([what, name].filter(Boolean).join(", ") || say().words.allRoutes);
  }

  /** While nobody has moved the camera it shows what is chosen; beside the list there is room for all. */
  private follow(): void {
    const subject = this.views?.subject;
    const route = this.tables.routes.get(this.route ?? -1);
    if (!route && subject === "route") this.views!.wall(true);
    if (route && subject && (this.arrangement.tall || subject === "route")) this.views!.route(route, this.tables);
  }

  private repaint(): void {
    const chosen = this.route === null ? undefined : this.tables.routes.get(this.route);
    const route = this.set ?? this.editor?.preview ?? chosen;
    const outlines = new Map<number, number>();
    for (const id of route?.holds ?? []) outlines.set(id, Outline.route);
    if (this.hold !== null) outlines.set(this.hold, Outline.chosen);
    for (const id of this.editor?.marked ?? []) outlines.set(id, Outline.marked);
    const alone = this.hold === null ? [] : [this.hold];
    const isEmpty = this.set?.holds.length === 0;
    const lit = isEmpty ? null : this.heat.shown ? new Set(alone) : route ? new Set([...route.holds, ...alone]) : this.panel.lit;
    this.stage?.paint(lit, outlines, this.heat.holds(this.tables));
    this.overlay?.flags(route ?? null, this.tables, this.set?.feet);
    this.overlay?.draw(this.lines);
  }

  private showCard(): void {
    const act: CardActions = {
      previous: () => this.step(-1),
      next: () => this.step(1),
      climber: () => this.climberView(),
      moves: null,
      close: () => this.choose(this.hold !== null && this.route !== null ? this.route : null, null),
      route: (id) => this.selectRoute(id),
    };
    const hold = this.hold === null ? undefined : this.tables.holds.get(this.hold);
    const route = this.route === null ? undefined : this.tables.routes.get(this.route);
    const may = this.moves?.routes.get(this.route ?? -1);
    if (may?.climbers.some(({ moves }) => moves.length > 0)) act.moves = () => this.climbRoute()?.play();
    const plain = this.player
      ? [this.player.root]
      : hold
        ? holdCard(hold, this.tables, act)
        : route
          ? routeCard(route, this.tables, act, may?.grade)
          : [];
    const { editor } = this;
    // The fields say what the plain card says, and a phone has no room for both.
    const parts = editor ? (editor.card() ?? [...plain.slice(0, 1), ...editor.controls(route ?? null, hold ?? null)]) : plain;
    const before = this.card.hidden;
    if (parts.length > 0) parts.push(h("slot", { name: "card" }));
    this.card.replaceChildren(...parts);
    this.card.hidden = parts.length === 0;
    this.shell.style.setProperty("--card", `${this.card.offsetHeight}px`);
    if (before === this.card.hidden) return;
    this.shell.classList.toggle("chosen", !this.card.hidden);
    // On a phone the card takes the list's place, and gives it back.
    const { sheet } = this.panel;
    if (before) this.preferredHeight = sheet.height;
    sheet.set(before ? "low" : this.preferredHeight);
  }

  private step(by: number): void {
    const shown = this.panel.shown();
    if (shown.length === 0) return;
    const at = shown.findIndex((route) => route.id === this.route);
    const next = at < 0 ? (by > 0 ? 0 : shown.length - 1) : (at + by + shown.length) % shown.length;
    this.selectRoute(shown[next]!.id, { move: true });
  }

  // Page ------------------------------------------------------------------------------------

  private build(): void {
    this.card.setAttribute("aria-label", say().words.chosen);
    this.bar.build({
      home: () => this.home(),
      climber: () => this.climberView(),
      measure: () => this.toggleMeasure(),
      share: () => void copyLink(this.link()).then((text) => this.say(text)),
      picture: () => void this.savePicture(),
    });
    this.panel = new RouteList();
    this.view.replaceChildren(this.canvas, this.bar.root, this.thread, this.heat.root, this.toast.root);
    this.shell.replaceChildren(this.panel.root, this.view, this.card, this.message.root);
    this.root.append(this.shell);
    this.panel.onRoute = (id) => this.selectRoute(id, { move: true });
    this.panel.onFilter = () => this.repaint();
    this.panel.sheet.onHeight = () => this.layout(true);
  }

  private layout(animate = false): void {
    this.arrange();
    if (!this.stage?.framing) return;
    this.views?.refit(animate);
    this.stage.drawNow();
  }

  private arrange(): void {
    this.arrangement.arrange(this.stage?.framing?.aspect, this.insets());
    this.chooseGrab();
    // Before there is a wall to draw its size would be set, and the canvas made anew, for nothing.
    if (this.stage?.framing) this.stage.resize(this.view.clientWidth, this.view.clientHeight);
  }

  private insets(): Insets {
    return this.arrangement.insets(this.route !== null || this.editor?.preview != null, this.editor?.height ?? 0);
  }

  /** As the page says; else the wall takes every touch where it is all of the page. */
  private chooseGrab(): void {
    this.grab?.set(grabMode(this.getAttribute("grab")) ?? (this.arrangement.alone ? "always" : "two-fingers"));
  }

  private wire(stage: Stage): void {
    const { signal } = this.gone;
    this.grab = new GestureCapture(this.canvas, stage.controls, (text) => this.say(text), signal);
    this.views = new CameraViews(stage, () => this.insets());
    stage.onFrame = () => this.overlay?.update();
    stage.onBlank = () => void this.refill(stage);
    stage.onLost = (lost) => this.say(lost ? say().words.interrupted : say().words.restored);
    for (const type of ["rest", "sleep"] as const) {
      stage.controls.addEventListener(type, () => this.saveLink());
    }
    const resizer = new ResizeObserver(() => this.layout());
    resizer.observe(this);
    signal.addEventListener("abort", () => resizer.disconnect());
    this.layout();
    const taps = {
      tap: (x: number, y: number) => this.tapped(x, y),
      double: () => this.lookCloser(),
    };
    listenForTaps(this.canvas, taps, signal);
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.canvas.addEventListener("pointermove", (event) => this.hover(event));
    this.dark.addEventListener("change", () => this.applyTheme(), { signal });
    const place = (): void => this.applyPlace(true);
    if (this.hasAttribute("links")) window.addEventListener("hashchange", place, { signal });
  }

  /** With a mouse, the pointer tells what can be chosen. */
  private hover({ pointerType, buttons, offsetX, offsetY }: PointerEvent): void {
    if (pointerType !== "mouse" || buttons !== 0 || !this.stage?.framing) return;
    const hold = this.stage.pick(offsetX, offsetY)?.hold ?? 0;
    this.canvas.classList.toggle("on-hold", this.tables.holds.has(hold));
  }

  private tapped(x: number, y: number): void {
    const hit = this.stage!.pick(x, y);
    this.touched = hit?.point ?? null;
    if (this.isMeasuring) {
      if (!hit) return;
      const length = this.overlay!.measure(hit.point, this.tables.metric);
      this.stage!.redraw();
      if (!length) return this.say(say().words.secondPoint);
      this.toast.announce(length);
      this.emit("measure", { text: length, ends: this.overlay!.measured });
      return;
    }
    if (this.set) return this.emit("hold-tap", { hold: this.tables.holds.get(hit?.hold ?? 0) ?? null });
    if (this.editor?.tapped(hit)) return;
    if (hit && hit.hold > 0 && this.tables.holds.has(hit.hold)) this.selectHold(hit.hold);
    else this.choose(null, null);
  }

  /** Closer to where the first of two taps was: what it chose may have moved the picture since. */
  private lookCloser(): void {
    if (this.touched && !this.isMeasuring) this.views!.closer(this.touched);
  }

  private key(event: KeyboardEvent): void {
    const { controls } = this.stage!;
    const did = handleKey(event, {
      controls,
      moved: () => this.views!.markMoved(),
      step: (by) => this.step(by),
      escape: () => (this.isMeasuring ? this.toggleMeasure() : this.choose(null, null)),
      home: () => this.home(),
      climber: () => this.climberView(),
      measure: () => this.toggleMeasure(),
    });
    if (did) this.stage!.redraw();
  }

  private toggleMeasure(): void {
    this.measuring = !this.isMeasuring;
  }

  private async savePicture(): Promise<void> {
    const blob = await this.picture();
    if (blob) download(blob);
    else this.say(say().words.noPicture);
  }

  private applyTheme(): void {
    const theme = this.getAttribute("theme");
    const dark = theme === "dark" || (theme !== "light" && this.dark.matches);
    this.classList.toggle("dark", dark);
    this.stage?.backdrop(dark ? "#15171b" : "#eef0f3");
  }

  /** The shown place; without the camera if the page chose it, because it depends on the screen. */
  private get place(): LinkedView {
    const subject = this.views?.subject ?? null;
    const itself = subject === "wall" || (subject === "route" && this.hold === null);
    return { route: this.route, hold: this.hold, camera: itself ? null : this.camera };
  }

  private applyPlace(animate: boolean): void {
    if (!this.hasAttribute("links") || !this.stage) return;
    const place = parseView(location.hash);
    if (place.hold !== null && this.tables.holds.has(place.hold)) this.selectHold(place.hold);
    else if (place.route !== null) this.selectRoute(place.route, { move: place.camera === null });
    if (place.camera) this.views?.lookFrom(place.camera, animate);
  }

  private saveLink(): void {
    if (this.hasAttribute("links") && this.hasAttribute("data-ready")) this.address.keep(() => this.place);
  }

  private say(text: string): void {
    const bars = [this.arrangement.tall ? this.bar.root : null, this.view.querySelector<HTMLElement>(".edit")];
    this.toast.say(text, 14 + Math.max(0, ...bars.map((bar) => (bar ? bar.offsetTop + bar.offsetHeight : 0))));
  }

  private emit(name: string, detail: unknown): void {
    this.dispatchEvent(new CustomEvent(name, { detail, bubbles: true, composed: true }));
  }
}
