/** Edit mode of an element: the editor with what it needs of the element's parts. */

import { Vector3 } from "three";
import type { Route, Tables, Vec3 } from "../data/types";
import { Editor } from "../edit/editor";
import { Server } from "../edit/server";
import type { Parts } from "./parts";
import type { Selection } from "./selection";

export function startEditor(parts: Parts, selection: Selection): void {
  const { element, view, canvas } = parts;
  const host = {
    view,
    stage: parts.stage!,
    canvas,
    draw: (drawing: boolean) => parts.draw(drawing),
    chosen: () => ({ route: parts.route, hold: parts.hold }),
    show: (tables: Tables) => {
      const { selected } = parts;
      parts.tables = tables;
      parts.list.fill(tables);
      const hold = selected.hold !== null && tables.holds.has(selected.hold) ? selected.hold : null;
      const route = hold === null ? selected.route : tables.holds.get(hold)!.route;
      selection.choose(route !== null && tables.routes.has(route) ? route : null, hold);
    },
    select: (route: number | null, hold: number | null) => selection.choose(route, hold),
    look: (place: Vec3) => parts.views?.closer(new Vector3(...place)),
    refresh: () => {
      selection.repaint();
      selection.showCard();
    },
    dots: (places: Vec3[]) => {
      parts.overlay?.mark(places);
      parts.stage?.redraw();
    },
    frame: (route: Route) => parts.views?.route(route, parts.tables),
    say: (text: string) => parts.say(text),
  };
  parts.editor?.dispose();
  parts.shell.classList.add("editing");
  const server = new Server(element.getAttribute("edit") || "api/edits", element.getAttribute("token") ?? "");
  parts.editor = new Editor(host, parts.tables, server);
  void parts.editor.start();
  parts.views?.refit(false);
}
