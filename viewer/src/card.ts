/** The card of the chosen route or hold. */

import { h, icon } from "./dom";
import type { Hold, Route, Tables } from "./types";
import { capital, holdName, holdSwatch, metres, routeName, steepness, swatch } from "./words";

export interface CardActions {
  previous(): void;
  next(): void;
  climber(): void;
  close(): void;
  route(id: number): void;
}

function facts(rows: [string, string][]): HTMLElement {
  return h("dl", {}, ...rows.map(([term, text]) => h("div", {}, h("dt", {}, term), h("dd", {}, text))));
}

function button(label: string, shape: Parameters<typeof icon>[0], act: () => void): HTMLElement {
  return h("button", { class: "tool", "aria-label": label, title: label, onClick: act }, icon(shape));
}

export function routeCard(route: Route, tables: Tables, act: CardActions): HTMLElement[] {
  const length = metres(route.length_m, tables.metric);
  const text = `${route.holds.length} holds · ${length} · ${steepness(route.steepness_deg)}`;
  return [
    h(
      "div",
      { class: "top" },
      h("span", { class: "swatch", style: `background:${swatch(route, tables)}` }),
      h("div", { class: "title" }, h("h3", {}, routeName(route)), h("p", { class: "sub" }, text)),
      button("Previous route", "previous", () => act.previous()),
      button("Next route", "next", () => act.next()),
      button("Show all routes", "close", () => act.close()),
    ),
    h(
      "div",
      { class: "actions" },
      h("button", { class: "pill main", onClick: () => act.climber() }, icon("climber"), "View as a climber"),
    ),
  ];
}

export function holdCard(hold: Hold, tables: Tables, act: CardActions): HTMLElement[] {
  const route = hold.route === null ? undefined : tables.routes.get(hold.route);
  const kind = hold.class === "volume" ? "Volume" : capital(hold.type ?? "–");
  const where = route
    ? routeName(route)
    : hold.class === "volume"
      ? "part of every route"
      : hold.role === "downclimb"
        ? "for climbing down"
        : "on no route";
  const sure = hold.score > 0 ? `${Math.round(hold.score * 100)} %` : "–";
  return [
    h(
      "div",
      { class: "top" },
      h("span", { class: "swatch", style: `background:${holdSwatch(hold)}` }),
      h(
        "div",
        { class: "title" },
        h("h3", {}, holdName(hold)),
        h("p", { class: "sub" }, `Hold ${hold.id} · ${where}`),
      ),
      route && button("Previous route", "previous", () => act.previous()),
      route && button("Next route", "next", () => act.next()),
      button("Close", "close", () => act.close()),
    ),
    facts([
      ["Colour", capital(hold.colour ?? "–")],
      ["Type", kind],
      ["Size", metres(hold.size_m, tables.metric)],
      ["Steepness", capital(steepness(hold.steepness_deg))],
      ["Certainty", sure],
    ]),
  ];
}
