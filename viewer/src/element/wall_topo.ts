/** `<wall-topo src="wall.glb">`: the viewer as one element. Documented in docs/viewer.md. */

import { isVision } from "../data/colour_vision";
import type { Vision } from "../data/colour_vision";
import type { Hold, HoldSet, Route, Vec3 } from "../data/types";
import type { ClimberRow } from "../data/wire";
import { say, speak } from "../languages";
import { measureIn } from "../languages/units";
import type { Person } from "../moves/moves_file";
import { h } from "../panels/dom";
import { keptVision } from "../panels/vision";
import type { HeatmapLegend, HeatmapSubject } from "../scene/heatmap";
import { Stage } from "../scene/stage";
import { copyLink, download } from "../sharing/share";
import style from "../style.css?inline";
import { preload } from "../tiers/preload";
import { yieldToPage } from "../tiers/yield_to_page";
import type { Climbing } from "./climbing";
import { Interaction } from "./interaction";
import { Loading } from "./loading";
import { PageLink } from "./page_link";
import { Parts } from "./parts";
import { Selection } from "./selection";
import { startEditor } from "./start_editor";

// A length of its own, so that what is inside has it as computed at the element.
try {
  CSS.registerProperty({ name: "--wall-topo-px", syntax: "<length>", inherits: true, initialValue: "1px" });
} catch {
  // The page has a second copy of the viewer, which registered it.
}

export class WallTopo extends HTMLElement {
  static readonly observedAttributes = ["src", "theme", "grab", "vision"];

  private readonly root: ShadowRoot;
  private readonly parts = new Parts(this);
  private readonly selection = new Selection(this.parts, () => this.pageLink.save());
  private readonly pageLink = new PageLink(this.parts, this.selection);
  private readonly loading = new Loading(this.parts, (stage) => this.shown(stage));
  private readonly interaction = new Interaction(this.parts, this.selection, {
    home: () => this.home(),
    climber: () => this.climberView(),
  });
  private readonly dark = matchMedia("(prefers-color-scheme: dark)");
  private gone = new AbortController();

  constructor() {
    super();
    this.root = this.attachShadow({ mode: "open" });
    // A constructed sheet: a content policy may forbid inline styles.
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    this.root.adoptedStyleSheets = [sheet];
  }

  connectedCallback(): void {
    const { parts } = this;
    this.gone = new AbortController();
    const { code, words } = speak([this.lang, ...navigator.languages]);
    parts.shell.lang = code;
    measureIn(this.getAttribute("units"));
    // A canvas whose context was given back cannot draw again: each life has its own.
    parts.canvas = h("canvas", { tabindex: 0, role: "img", part: "canvas", "aria-label": words.picture });
    if (this.getAttribute("loading") !== "lazy") return void this.begin();
    parts.shell.replaceChildren(parts.placeholder.root);
    this.root.append(parts.shell);
    this.loading.whenNear(() => void this.begin(), this.gone.signal);
  }

  disconnectedCallback(): void {
    this.gone.abort();
    this.loading.dispose();
    this.pageLink.dispose();
    this.climbing.stop();
    this.parts.detach();
  }

  attributeChangedCallback(name: string, before: string | null, after: string | null): void {
    if (before === after) return;
    if (name === "vision") this.see(chosenVision(this));
    if (!this.stage) return;
    if (name === "src") void this.loading.load();
    if (name === "theme") this.applyTheme();
    if (name === "grab") this.parts.chooseCapture();
  }

  // The JS API -----------------------------------------------------------------------------

  /** Begin to read a wall that an element will soon show; `src` as that one will have it, with a `heading` of its own. */
  static expect(src: string): void {
    preload(src);
  }

  /** The routes, as in `routes.json`. */
  get routes(): Route[] {
    return [...this.parts.tables.routes.values()];
  }

  /** The holds, as in `holds.json`. */
  get holds(): Hold[] {
    return [...this.parts.tables.holds.values()];
  }

  /** Id of the lit route, or null. */
  get selectedRoute(): number | null {
    return this.parts.selected.route;
  }

  /** Id of the chosen hold, or null. */
  get selectedHold(): number | null {
    return this.parts.selected.hold;
  }

  /** Whether taps measure a distance; each second tap emits `measure`. */
  get measuring(): boolean {
    return this.interaction.measuring;
  }

  set measuring(on: boolean) {
    this.interaction.measuring = on;
  }

  /** Whether taps emit `point-tap` with their place on the wall, and choose nothing. */
  get pointing(): boolean {
    return this.interaction.pointing;
  }

  set pointing(on: boolean) {
    this.interaction.pointing = on;
  }

  /** Light up a route (null: show all); `move` turns the camera to it. */
  selectRoute(id: number | null, options: { move?: boolean } = {}): void {
    this.selection.route(id, options);
  }

  /** Show only these routes, in the list and on the wall, where the others fade; null: all. */
  showRoutes(ids: Iterable<number> | null): void {
    this.parts.list.limit(ids);
    this.selection.repaint();
  }

  /**
   * Colour the holds of routes, or single holds, by a value from 0 to 1, by id; the rest fades. With `words` a legend
   * says what the ends stand for. null: as photographed.
   */
  showHeat(values: Iterable<[number, number]> | null, words: HeatmapLegend | null = null, of: HeatmapSubject = "routes"): void {
    this.parts.heatmap.set(values, words, of);
    this.selection.repaint();
  }

  /**
   * Light up these holds in the stead of a route, with flags, while taps emit `hold-tap` and choose nothing; `move`
   * turns the camera to them. null: routes again.
   */
  showHolds(set: HoldSet | null, options: { move?: boolean } = {}): void {
    const { parts, selection } = this;
    if (set && !selection.set) selection.choose(null, null);
    if (set?.moves !== selection.set?.moves) selection.climbing.end();
    selection.set = set;
    selection.repaint();
    selection.announceCursor();
    if (options.move && set?.holds.length) parts.views?.route(set, parts.tables, true, selection.climbing.player?.places);
  }

  /** Draw dashed lines on the wall, each through places in the scan's frame; an empty list: none. */
  showLines(lines: Vec3[][]): void {
    this.selection.lines = lines;
    this.selection.repaint();
  }

  /** Draw ropes on the wall, each through its clips to the anchor, in the scan's frame; an empty list: none. */
  showRopes(ropes: Vec3[][]): void {
    this.selection.ropes = ropes;
    this.selection.repaint();
  }

  /** A hold in words: its name, its use in its route, its height over the mat; empty for an unknown id. */
  describeHold(id: number): string {
    const { holds, routes } = this.parts.tables;
    const hold = holds.get(id);
    return hold ? this.selection.holdWords(hold, routes.get(hold.route ?? -1)) : "";
  }

  /** Outline a hold and turn to it if need be, as for a list beside the wall; null: none. */
  pointToHold(id: number | null): void {
    this.selection.pointTo(id);
  }

  /** Outline the holds of a route, as for a list beside the wall; null: none. */
  pointToRoute(id: number | null): void {
    this.selection.pointToRoute(id);
  }

  /** Choose a hold and light up its route. */
  selectHold(id: number | null): void {
    this.selection.hold(id);
  }

  /**
   * A figure climbs the selected route, as the file of the attribute `moves` has it, which is read now if it was not
   * before; or the holds of `showHolds`, as their own `moves` have it. It is the climber who reaches about as high as
   * `person`. Returns that climber; null where no moves are known.
   */
  async showMoves(person: Person | null = null): Promise<ClimberRow | null> {
    const { signal } = this.loading;
    if (!this.climbing.isRead && signal) await this.climbing.read(signal);
    if (signal?.aborted) return null;
    const player = this.climbing.begin(person);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) player?.play();
    return player?.shown ?? null;
  }

  /** The figure goes, and the card of the route comes back. */
  hideMoves(): void {
    this.climbing.end();
  }

  /** The whole wall, from the framing. */
  home(): void {
    this.parts.views?.wall(true);
  }

  /** From where a climber stands, looking at the chosen route (or the whole wall). */
  climberView(): void {
    const { views, route, tables } = this.parts;
    views?.climber(route ?? undefined, tables);
  }

  /** The whole wall from one side (-1), the front (0), the other side (1), or between: for a wall that turns. */
  swing(share: number): void {
    this.parts.views?.swing(share);
  }

  /** The drawn wall as a PNG blob, without text. */
  screenshot(): Promise<Blob | null> {
    return this.stage ? this.stage.screenshot() : Promise.resolve(null);
  }

  /** A PNG blob to share: the drawn wall with flags at start and top, and a caption. */
  async picture(): Promise<Blob | null> {
    return this.pageLink.picture(await this.screenshot());
  }

  /** The address of this page with route, hold and camera in it. */
  link(): string {
    return this.pageLink.url;
  }

  /** Eye and target, six numbers in the scan's frame; null before a wall stands. */
  get camera(): number[] | null {
    return this.stage?.rig.place ?? null;
  }

  /** The position of a hold or point on the element's canvas, in CSS pixels. */
  project(place: number | [number, number, number]): { x: number; y: number; ahead: boolean } | null {
    const point = typeof place === "number" ? this.parts.tables.holds.get(place)?.position : place;
    return point && this.stage ? this.stage.rig.project(point) : null;
  }

  /** The hold drawn at a point of the canvas (0: the wall), or null where nothing is. */
  pickAt(x: number, y: number): number | null {
    return this.stage?.pick(x, y)?.hold ?? null;
  }

  // Life cycle ------------------------------------------------------------------------------

  /** The 3D picture; null before it is built. */
  private get stage(): Stage | null {
    return this.parts.stage;
  }

  private get climbing(): Climbing {
    return this.selection.climbing;
  }

  private async begin(): Promise<void> {
    const { signal } = this.gone;
    this.build();
    await yieldToPage();
    if (signal.aborted) return;
    const source = this.getAttribute("src");
    const coming = this.loading.request(); // read while the stage is built
    await yieldToPage();
    if (signal.aborted) return;
    let stage: Stage;
    try {
      stage = new Stage(this.parts.canvas);
    } catch {
      return this.loading.fail(say().words.noWebGl);
    }
    this.parts.attach(stage, signal);
    stage.onBlank = () => void this.loading.refill(stage);
    this.interaction.listen(signal);
    this.pageLink.listen(signal);
    this.dark.addEventListener("change", () => this.applyTheme(), { signal });
    this.applyTheme();
    await this.loading.load(this.getAttribute("src") === source ? coming : undefined);
  }

  private build(): void {
    const { parts, selection } = this;
    parts.build({
      home: () => this.home(),
      climber: () => this.climberView(),
      measure: () => (this.measuring = !this.measuring),
      share: () => void copyLink(this.link()).then((text) => parts.say(text)),
      picture: () => void this.savePicture(),
    });
    parts.list.onRoute = (id) => selection.route(id, { move: true });
    parts.list.onFocus = (id) => selection.pointToRoute(id);
    parts.list.vision = chosenVision(this);
    parts.list.onVision = (vision) => this.see(vision);
    parts.list.onFilter = () => selection.repaint();
    this.root.append(parts.shell);
  }

  /** The first tier is in the picture: everything around it, once the wall is known. */
  private shown(stage: Stage): void {
    const { parts } = this;
    const { routes, holds } = parts.tables;
    parts.list.sheet.set(routes.size > 0 && parts.layout.roomy ? "half" : "low");
    parts.placeholder.hide();
    parts.arrange();
    this.selection.choose(null, null);
    parts.views!.wall(false);
    this.pageLink.apply(false);
    if (this.hasAttribute("edit")) startEditor(parts, this.selection);
    else void this.climbing.read(this.loading.signal!);
    stage.drawNow();
    this.setAttribute("data-ready", "first");
    parts.emit("wall-load", { routes: routes.size, holds: holds.size });
  }

  private async savePicture(): Promise<void> {
    const blob = await this.picture();
    if (blob) download(blob);
    else this.parts.say(say().words.noPicture);
  }

  /** Tell colours apart for a colour vision. */
  private see(vision: Vision | null): void {
    const { parts } = this;
    parts.list.vision = vision;
    if (!this.stage) return; // the list is filled with it later
    parts.list.fill(parts.tables);
    this.selection.repaint();
    this.selection.showCard();
  }

  private applyTheme(): void {
    const theme = this.getAttribute("theme");
    const dark = theme === "dark" || (theme !== "light" && this.dark.matches);
    this.classList.toggle("dark", dark);
    this.stage?.backdrop(dark ? "#15171b" : "#eef0f3");
  }
}

/** As the attribute says; without one, as kept in the browser. */
function chosenVision(element: HTMLElement): Vision | null {
  const name = element.getAttribute("vision");
  return name === null ? keptVision() : isVision(name) ? name : null;
}
