/** The card of the chosen route or hold. */

import { h, icon } from "./dom";
import type { Hold, Route, Tables } from "./types";
import { capital, holdName, holdSwatch, metres, routeFacts, routeName, steepness, swatch } from "./words";

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

/** Swatch, name and what is said below it. */
function top(colour: string, name: string, text: string, close: HTMLElement): HTMLElement {
  return h(
    "div",
    { class: "top" },
    h("span", { class: "swatch", style: `background:${colour}` }),
    h("div", { class: "title" }, h("h3", {}, name), h("p", { class: "sub" }, text)),
    close,
  );
}

function actions(act: CardActions): HTMLElement {
  const label = "View as a climber";
  return h(
    "div",
    { class: "actions" },
    button("Previous route", "previous", () => act.previous()),
    h("button", { class: "pill main", onClick: () => act.climber() }, icon("climber"), label),
    button("Next route", "next", () => act.next()),
  );
}

export function routeCard(route: Route, tables: Tables, act: CardActions): HTMLElement[] {
  const close = button("Show all routes", "close", () => act.close());
  const text = routeFacts(route, tables.metric);
  return [top(swatch(route, tables), routeName(route), text, close), actions(act)];
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
  const close = button(route ? "Back to the route" : "Close", "close", () => act.close());
  const parts = [
    top(holdSwatch(hold), holdName(hold), `Hold ${hold.id} · ${where}`, close),
    facts([
      ["Colour", capital(hold.colour ?? "–")],
      ["Type", kind],
      ["Size", metres(hold.size_m, tables.metric)],
      ["Steepness", capital(steepness(hold.steepness_deg))],
    ]),
  ];
  if (route) parts.push(actions(act));
  return parts;
}
