/** The list of routes with its filters. */

import { lean, STEEP_DEG, whole } from "../data/steepness";
import type { Vision } from "../data/colour_vision";
import type { Route, Tables } from "../data/types";
import { say } from "../languages";
import { capital, colourName, routeFacts, routeName, wallFacts } from "../languages/format";
import { BottomSheet } from "./bottom_sheet";
import { h } from "./dom";
import { stepFocus } from "./focus";
import { routeBackground } from "./swatch";
import { visionChoice } from "./vision";

const STEEPNESS: ["slab" | "vertical" | "overhang" | "steep", (degrees: number) => boolean][] = [
  ["slab", (degrees) => lean(degrees) === "slab"],
  ["vertical", (degrees) => lean(degrees) === "vertical"],
  ["overhang", (degrees) => lean(degrees) === "overhang"],
  ["steep", (degrees) => whole(degrees) >= STEEP_DEG],
];

export class RouteList {
  readonly root = h("aside", { class: "side", part: "list", "aria-label": say().words.routes });
  /** Called with a route's id, or null to show all. */
  onRoute: (id: number | null) => void = () => {};
  /** Called with the route whose row has the keyboard's focus, or null. */
  onFocus: (id: number | null) => void = () => {};
  /** Called when other routes pass the filters. */
  onFilter: () => void = () => {};
  /** Called when another colour vision is chosen. */
  onVision: (vision: Vision | null) => void = () => {};
  /** The reader's colour vision, for the rows that are filled in next. */
  vision: Vision | null = null;
  /** On a phone the list is a sheet. */
  readonly sheet: BottomSheet;
  private readonly title = h("h2", { part: "title" });
  private readonly summary = h("p");
  private tables: Tables | null = null;
  private readonly colours = new Set<string>();
  private steep = "";
  /** Only these, whatever the filters say; null: all. */
  private only: ReadonlySet<number> | null = null;
  private readonly list = h("ul", { class: "routes" });
  private buttons = new Map<number, HTMLButtonElement>();
  private active: number | null = null;

  constructor() {
    const handle = h("button", { class: "handle" });
    const head = h("div", { class: "head" }, handle, h("div", {}, this.title, this.summary));
    this.root.append(head, this.list);
    this.sheet = new BottomSheet(this.root, head, handle);
    this.list.addEventListener("keydown", (event) => stepFocus(event, [...this.buttons.values()]));
    this.list.addEventListener("focusout", () => this.onFocus(null));
  }

  /** Routes in the order of the list, after filtering. */
  shown(): Route[] {
    const test = STEEPNESS.find(([key]) => key === this.steep)?.[1];
    return [...(this.tables?.routes.values() ?? [])].filter(
      (route) =>
        (!this.only || this.only.has(route.id)) &&
        (this.colours.size === 0 || this.colours.has(route.colour ?? "")) &&
        (!test || (route.steepness_deg != null && test(route.steepness_deg))),
    );
  }

  /** Holds of the routes that pass the filters; null while nothing is filtered. */
  get lit(): Set<number> | null {
    if (this.colours.size === 0 && this.steep === "" && !this.only) return null;
    return new Set(this.shown().flatMap((route) => route.holds));
  }

  fill(tables: Tables): void {
    this.tables = tables;
    const count = tables.routes.size;
    this.title.textContent = tables.title;
    this.summary.textContent = wallFacts(tables);
    this.root.querySelector(".filters")?.remove();
    if (count > 0) this.list.before(this.filters(tables));
    this.root.classList.toggle("bare", count === 0);
    this.refresh();
  }

  /** Only these routes are listed; null: all. */
  limit(ids: Iterable<number> | null): void {
    this.only = ids && new Set(ids);
    if (this.tables) this.refresh();
  }

  activate(id: number | null): void {
    this.active = id;
    for (const [key, button] of this.buttons) {
      button.setAttribute("aria-pressed", String(key === id));
      if (key === id) this.reveal(button);
    }
  }

  /** Scrolls the list alone: `scrollIntoView` would scroll the page around an embedded wall too. */
  private reveal(button: HTMLElement): void {
    const [row, list] = [button.getBoundingClientRect(), this.list.getBoundingClientRect()];
    const left = row.left + row.width / 2 - (list.left + list.width / 2);
    const top = Math.min(0, row.top - list.top) + Math.max(0, row.bottom - list.bottom);
    this.list.scrollBy({ left, top });
  }

  private filters(tables: Tables): HTMLElement {
    const box = h("div", { class: "filters", role: "group", part: "filters", "aria-label": say().words.filter });
    const seen = new Map<string, Route>();
    for (const route of tables.routes.values()) seen.set(route.colour ?? "", route);
    for (const [colour, route] of seen) {
      const chip = h(
        "button",
        { class: "chip", "aria-pressed": String(this.colours.has(colour)), "data-colour": colour },
        h("span", { class: "swatch", style: `background:${routeBackground(route, tables, this.vision)}` }),
        capital(colour ? colourName(colour) : say().words.noColour),
      );
      chip.addEventListener("click", () => {
        const on = !this.colours.delete(colour);
        if (on) this.colours.add(colour);
        chip.setAttribute("aria-pressed", String(on));
        this.filtered();
      });
      box.append(chip);
    }
    const choose = h("select", { "aria-label": say().words.filterSteepness });
    choose.append(h("option", { value: "" }, say().words.anySteepness));
    for (const [key] of STEEPNESS) choose.append(h("option", { value: key }, capital(say().words[key])));
    choose.addEventListener("change", () => {
      this.steep = choose.value;
      this.filtered();
    });
    choose.value = this.steep;
    box.append(choose, visionChoice(this.vision, (vision) => this.onVision(vision)));
    return box;
  }

  private filtered(): void {
    this.refresh();
    this.onFilter();
  }

  private refresh(): void {
    const tables = this.tables!;
    this.buttons.clear();
    const rows = this.shown().map((route) => {
      const button = h(
        "button",
        { class: "route", part: "route", "data-route": route.id, "aria-pressed": String(route.id === this.active) },
        h("span", { class: "swatch", style: `background:${routeBackground(route, tables, this.vision)}` }),
        h("span", { class: "name" }, routeName(route)),
        h("span", { class: "meta" }, routeFacts(route, tables.metric)),
      );
      button.addEventListener("click", () => {
        this.onRoute(route.id === this.active ? null : route.id);
      });
      button.addEventListener("focus", () => button.matches(":focus-visible") && this.onFocus(route.id));
      this.buttons.set(route.id, button);
      return h("li", {}, button);
    });
    const none = tables.routes.size ? say().words.noneFits : this.nothing(tables);
    this.list.replaceChildren(...(rows.length ? rows : [h("li", { class: "empty" }, none)]));
  }

  private nothing(tables: Tables): string {
    return tables.holds.size ? say().words.noRoutes : say().words.noHolds;
  }
}
