/** The list of routes with its filters. */

import { h } from "./dom";
import { Sheet } from "./sheet";
import type { Route, Tables } from "./types";
import { capital, plural, routeFacts, routeName, swatch } from "./words";

const STEEPNESS: [string, string, (degrees: number) => boolean][] = [
  ["", "Any steepness", () => true],
  ["slab", "Slab", (degrees) => degrees < -3],
  ["vertical", "Vertical", (degrees) => Math.abs(degrees) <= 10],
  ["overhang", "Overhang", (degrees) => degrees > 10],
  ["roof", "Steep, 35° and more", (degrees) => degrees >= 35],
];

export class Panel {
  readonly root = h("aside", { class: "side", "aria-label": "Routes" });
  /** Called with a route's id, or null to show all. */
  onRoute: (id: number | null) => void = () => {};
  /** On a phone the list is a sheet. */
  readonly sheet: Sheet;
  private readonly title = h("h2");
  private readonly summary = h("p");
  private tables: Tables | null = null;
  private readonly colours = new Set<string>();
  private steep = "";
  private readonly list = h("ul", { class: "routes" });
  private buttons = new Map<number, HTMLButtonElement>();
  private active: number | null = null;

  constructor() {
    const handle = h("button", { class: "handle" });
    const head = h("div", { class: "head" }, handle, h("div", {}, this.title, this.summary));
    this.root.append(head, this.list);
    this.sheet = new Sheet(this.root, head, handle);
    this.list.addEventListener("keydown", (event) => this.arrows(event));
  }

  /** Routes in the order of the list, after filtering. */
  shown(): Route[] {
    const test = STEEPNESS.find(([key]) => key === this.steep)![2];
    return [...(this.tables?.routes.values() ?? [])].filter(
      (route) =>
        (this.colours.size === 0 || this.colours.has(route.colour ?? "")) &&
        (this.steep === "" || (route.steepness_deg != null && test(route.steepness_deg))),
    );
  }

  fill(tables: Tables): void {
    this.tables = tables;
    const holds = [...tables.holds.values()].filter((hold) => hold.class !== "volume").length;
    const count = tables.routes.size;
    this.title.textContent = tables.title;
    this.summary.textContent = `${plural(count, "route")} · ${plural(holds, "hold")}`;
    this.root.querySelector(".filters")?.remove();
    if (count > 0) this.list.before(this.filters(tables));
    this.root.classList.toggle("bare", count === 0);
    this.refresh();
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
    const box = h("div", { class: "filters", role: "group", "aria-label": "Filter the routes" });
    const seen = new Map<string, Route>();
    for (const route of tables.routes.values()) seen.set(route.colour ?? "", route);
    for (const [colour, route] of seen) {
      const chip = h(
        "button",
        { class: "chip", "aria-pressed": String(this.colours.has(colour)), "data-colour": colour },
        h("span", { class: "swatch", style: `background:${swatch(route, tables)}` }),
        capital(colour || "no colour"),
      );
      chip.addEventListener("click", () => {
        const on = !this.colours.delete(colour);
        if (on) this.colours.add(colour);
        chip.setAttribute("aria-pressed", String(on));
        this.refresh();
      });
      box.append(chip);
    }
    const choose = h("select", { "aria-label": "Filter by steepness" });
    for (const [key, label] of STEEPNESS) choose.append(h("option", { value: key }, label));
    choose.addEventListener("change", () => {
      this.steep = choose.value;
      this.refresh();
    });
    choose.value = this.steep;
    box.append(choose);
    return box;
  }

  private refresh(): void {
    const tables = this.tables!;
    this.buttons.clear();
    const rows = this.shown().map((route) => {
      const button = h(
        "button",
        { class: "route", "data-route": route.id, "aria-pressed": String(route.id === this.active) },
        h("span", { class: "swatch", style: `background:${swatch(route, tables)}` }),
        h("span", { class: "name" }, routeName(route)),
        h("span", { class: "meta" }, routeFacts(route, tables.metric)),
      );
      button.addEventListener("click", () => {
        this.onRoute(route.id === this.active ? null : route.id);
      });
      this.buttons.set(route.id, button);
      return h("li", {}, button);
    });
    const none = tables.routes.size ? "No route fits the filters." : this.nothing(tables);
    this.list.replaceChildren(...(rows.length ? rows : [h("li", { class: "empty" }, none)]));
  }

  private nothing(tables: Tables): string {
    return tables.holds.size ? "No routes were found among the holds." : "No holds were found on this wall.";
  }

  private arrows(event: KeyboardEvent): void {
    const buttons = [...this.buttons.values()];
    const root = this.root.getRootNode() as ShadowRoot;
    const at = buttons.indexOf(root.activeElement as HTMLButtonElement);
    const step: Record<string, number> = {
      ArrowDown: at + 1,
      ArrowRight: at + 1,
      ArrowUp: at - 1,
      ArrowLeft: at - 1,
      Home: 0,
      End: buttons.length - 1,
    };
    const to = step[event.key];
    if (to === undefined || at < 0) return;
    event.preventDefault();
    buttons[Math.max(0, Math.min(buttons.length - 1, to))]?.focus();
  }
}
