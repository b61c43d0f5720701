/** The selected route and hold: what they change in the picture, the list and the card. */

import { Vector3 } from "three";
import { looksLike } from "../data/colour_vision";
import type { Hold, HoldSet, Route, Vec3 } from "../data/types";
import type { Editor } from "../edit/editor";
import { say } from "../languages";
import { holdName, lengthText, routeName } from "../languages/format";
import { holdCard, routeCard } from "../panels/cards";
import type { CardActions } from "../panels/cards";
import { h } from "../panels/dom";
import { replaceKeepingFocus } from "../panels/focus";
import { holdList } from "../panels/hold_list";
import { Outline } from "../scene/hold_state";
import type { NamedPlace } from "../scene/route_names";
import { Climbing } from "./climbing";
import type { Parts } from "./parts";

export class Selection {
  readonly climbing: Climbing;
  /** Holds that the page shows in the stead of a route. */
  set: HoldSet | null = null;
  /** Dashed lines that the page shows on the wall. */
  lines: Vec3[][] = [];
  /** Ropes that the page shows on the wall, each through its clips to the anchor. */
  ropes: Vec3[][] = [];
  /** Height of the list before a card took its place. */
  private preferredHeight: "low" | "half" | "full" = "half";
  /** The hold whose card was shown last. */
  private lastHold: number | null = null;
  /** Whether the list of a route's holds is unfolded. */
  private unfolded = false;

  /** `changed`: called when another route or hold is selected. */
  constructor(
    private readonly parts: Parts,
    private readonly changed: () => void,
  ) {
    this.climbing = new Climbing(parts, () => this.set, () => this.showCard());
  }

  choose(route: number | null, hold: number | null): void {
    const { parts } = this;
    const before = parts.selected;
    const differs = route !== before.route || hold !== before.hold;
    if (route !== before.route || hold !== null) this.climbing.stop();
    parts.selected = { route, hold };
    this.repaint();
    this.showCard();
    parts.list.activate(route);
    this.follow();
    if (!differs) return;
    this.changed();
    if (hold !== null) parts.emit("hold-select", { hold: parts.tables.holds.get(hold) });
    parts.emit("route-select", { route: route === null ? null : parts.tables.routes.get(route) });
    const name = route === null ? "" : routeName(parts.tables.routes.get(route)!);
    const what = hold === null ? "" : holdName(parts.tables.holds.get(hold)!);
    parts.toast.announce([what, name].filter(Boolean).join(", ") || say().words.allRoutes);
  }

  /** Light up a route (null: show all); `move` turns the camera to it. */
  route(id: number | null, options: { move?: boolean } = {}): void {
    const { parts } = this;
    this.choose(id !== null && parts.tables.routes.has(id) ? id : null, null);
    if (options.move && parts.route) parts.views?.route(parts.route, parts.tables, true, this.climbing.player?.places);
  }

  /** Select a hold and light up its route. */
  hold(id: number | null): void {
    const hold = id === null ? undefined : this.parts.tables.holds.get(id);
    this.choose(hold ? hold.route : this.parts.selected.route, hold ? hold.id : null);
  }

  /** The next or previous route of the list. */
  step(by: number): void {
    const shown = this.parts.list.shown();
    if (shown.length === 0) return;
    const at = shown.findIndex((route) => route.id === this.parts.selected.route);
    const next = at < 0 ? (by > 0 ? 0 : shown.length - 1) : (at + by + shown.length) % shown.length;
    this.route(shown[next]!.id, { move: true });
  }

  /** The keyboard's cursor goes to a hold, which screen readers hear; null: it goes away. */
  moveCursor(hold: number | null): void {
    if (this.parts.cursor === hold) return;
    this.pointTo(hold);
    this.announceCursor();
  }

  /** Show where a hold is, turning the camera if need be; null: none. */
  pointTo(hold: number | null): void {
    const { parts } = this;
    if (parts.cursor === hold) return;
    parts.cursor = hold;
    this.repaint();
    const place = parts.tables.holds.get(hold ?? -1)?.position;
    if (place) parts.views?.bringIn(new Vector3(...place));
  }

  /** Show the holds of a route that the keyboard's focus is on; null: none. */
  pointToRoute(id: number | null): void {
    if (this.parts.focused === id) return;
    this.parts.focused = id;
    this.repaint();
  }

  /** Screen readers hear the hold at the cursor, its use and route, its height. */
  announceCursor(): void {
    const { cursor, tables, toast } = this.parts;
    const hold = tables.holds.get(cursor ?? -1);
    if (!hold) return;
    const route = this.set ? undefined : tables.routes.get(hold.route ?? -1);
    toast.announce(this.holdWords(hold, this.set ?? route, route && routeName(route)));
  }

  /** "Blue jug, Start, 45 cm": a hold, its use in a route or set, that one's name where it is given, the height over the mat. */
  holdWords(hold: Hold, of: Route | HoldSet | undefined, name = ""): string {
    return [holdName(hold), ...usesOf(hold.id, of), name, this.heightOf(hold.position[2])].filter(Boolean).join(", ");
  }

  /** "Wall, 45 cm", or the hold that is there. */
  placeWords(place: Vector3, hold: Hold | undefined): string {
    return `${hold ? holdName(hold) : say().words.wall}, ${this.heightOf(place.z)}`;
  }

  private heightOf(z: number): string {
    const { tables, stage } = this.parts;
    return lengthText(z - (stage?.rig.framing?.floor ?? 0), tables.metric);
  }

  /** Draw lit and faded holds, outlines, flags, lines and ropes anew. */
  repaint(): void {
    const { parts, set } = this;
    const { stage, overlay, editor, heatmap, tables } = parts;
    const { hold } = parts.selected;
    const route = set ?? editor?.preview ?? parts.route;
    const outlines = new Map<number, number>();
    for (const id of route?.holds ?? []) outlines.set(id, Outline.route);
    if (hold !== null) outlines.set(hold, Outline.chosen);
    for (const id of editor?.marked ?? []) outlines.set(id, Outline.marked);
    for (const id of tables.routes.get(parts.focused ?? -1)?.holds ?? []) outlines.set(id, Outline.cursor);
    if (parts.cursor !== null) outlines.set(parts.cursor, Outline.cursor);
    const alone = hold === null ? [] : [hold];
    const isEmpty = set?.holds.length === 0;
    const lit = isEmpty ? null : heatmap.shown ? new Set(alone) : route ? new Set([...route.holds, ...alone]) : parts.list.lit;
    stage?.paint(lit, outlines, heatmap.holds(tables));
    overlay?.flags(route, tables, set?.feet);
    overlay?.names.set(lit === null || lit === parts.list.lit ? this.namesToShow() : []);
    overlay?.draw(this.lines);
    overlay?.hang(this.ropes);
  }

  /** The routes in the list whose colour looks like another route's, at their starts. */
  private namesToShow(): NamedPlace[] {
    const { list, tables, editor } = this.parts;
    const { vision } = list;
    if (vision === null || this.set || editor) return [];
    const shown = list.shown();
    const colours = new Set(shown.map(({ colour }) => colour));
    return shown.flatMap((route) => {
      const place = tables.holds.get(route.start?.[0] ?? route.holds[0] ?? -1)?.position;
      return place && looksLike(route.colour, colours, vision) ? [{ name: routeName(route), place }] : [];
    });
  }

  showCard(): void {
    const { parts } = this;
    const { card, editor } = parts;
    const plain = this.plainCard();
    // The fields say what the plain card says, and a phone has no room for both.
    const content = editor ? (editor.card() ?? this.editingCard(plain, editor)) : plain;
    const wasHidden = card.hidden;
    if (content.length > 0) content.push(h("slot", { name: "card" }));
    const hadFocus = card.contains((card.getRootNode() as ShadowRoot).activeElement);
    replaceKeepingFocus(card, content, this.lastHold);
    this.lastHold = parts.selected.hold;
    card.hidden = content.length === 0;
    if (card.hidden && hadFocus) parts.canvas.focus();
    parts.shell.style.setProperty("--card", `${card.offsetHeight}px`);
    if (wasHidden === card.hidden) return;
    parts.shell.classList.toggle("chosen", !card.hidden);
    // On a phone the card takes the list's place, and gives it back.
    const { sheet } = parts.list;
    if (wasHidden) this.preferredHeight = sheet.height;
    sheet.set(wasHidden ? "low" : this.preferredHeight);
  }

  private editingCard(plain: HTMLElement[], editor: Editor): HTMLElement[] {
    const { route, hold } = this.parts;
    return [...plain.slice(0, 1), ...editor.controls(route, hold), ...(route && !hold ? [this.holdsOf(route)] : [])];
  }

  /** The card that visitors see: the climbing figure's, the hold's or the route's. */
  private plainCard(): HTMLElement[] {
    const { parts, climbing } = this;
    const { route, hold, tables } = parts;
    if (climbing.player) return [climbing.player.root];
    const actions: CardActions = {
      previous: () => this.step(-1),
      next: () => this.step(1),
      climber: () => parts.views?.climber(parts.route ?? undefined, parts.tables),
      moves: climbing.isPossible ? () => climbing.begin()?.play() : null,
      close: () => this.choose(parts.selected.hold === null ? null : parts.selected.route, null),
      route: (id) => this.route(id),
      vision: parts.list.vision,
    };
    if (hold) return holdCard(hold, tables, actions);
    return route ? routeCard(route, tables, actions, this.holdsOf(route), climbing.ofRoute?.grade) : [];
  }

  private holdsOf(route: Route): HTMLElement {
    const holds = route.holds.flatMap((id) => this.parts.tables.holds.get(id) ?? []);
    return holdList(holds, this.unfolded, {
      words: (hold) => this.holdWords(hold, route),
      point: (hold) => this.pointTo(hold),
      choose: (hold) => this.hold(hold),
      fold: (open) => (this.unfolded = open),
      vision: this.parts.list.vision,
    });
  }

  /** While nobody has moved the camera it shows what is selected; beside the list there is room for all. */
  private follow(): void {
    const { views, route, layout, tables } = this.parts;
    const subject = views?.subject;
    if (!route && subject === "route") views!.wall(true);
    if (route && subject && (layout.tall || subject === "route")) views!.route(route, tables);
  }
}

/** The uses of a hold in a route or set, in words. */
function usesOf(hold: number, of: Route | HoldSet | undefined): string[] {
  const { words } = say();
  if (!of) return [];
  const feet = "feet" in of ? of.feet : of.footholds;
  const uses: [number[] | null | undefined, string][] = [
    [of.start, words.start],
    [of.top, words.top],
    ["zone" in of ? of.zone : null, words.zone],
    [feet, words.foot],
  ];
  return uses.filter(([ids]) => ids?.includes(hold)).map(([, word]) => word);
}
