/** Where the camera goes by itself: the whole wall, a route, a climber's eyes. */

import { Box3, Vector3 } from "three";
import type { Insets, Stage } from "./stage";
import type { Route, Tables, Vec3 } from "./types";

const EYES = 1.65; // metres over the mat
const NEAR = 2.2; // metres that a climber stands from the start, at least
const FAR = 7; // and at most
const ASIDE = 70; // degrees from the wall's front that a route is looked at from, at most

/** A place as a climber sees it: how far it leans out from the start, how far above the eyes. */
interface Sight {
  out: number;
  up: number;
}

export class Views {
  /** Repeats the present view for a canvas of another size; null once the camera was moved by hand. */
  private again: ((animate: boolean) => void) | null = null;
  private shown: "wall" | "route" | null = null;

  constructor(
    private readonly stage: Stage,
    private readonly insets: () => Insets,
  ) {
    stage.controls.addEventListener("controlstart", () => this.let());
    stage.canvas.addEventListener("wheel", () => this.let(), { passive: true });
  }

  /** What the camera shows by itself; null where somebody moved it. */
  get subject(): "wall" | "route" | null {
    return this.shown;
  }

  /** The camera was moved by hand: a new size of the canvas leaves it where it is. */
  let(): void {
    this.again = null;
    this.shown = null;
  }

  /** What is free of the canvas has changed. */
  refit(animate: boolean): void {
    this.again?.(animate);
  }

  /** The whole wall, from the front. */
  wall(animate: boolean): void {
    const { front } = this.stage;
    if (!front) return;
    this.stage.frame(front.places, front.direction, animate, this.insets());
    this.again = (smooth) => this.wall(smooth);
    this.shown = "wall";
  }

  route(route: Route, tables: Tables, animate = true): void {
    const { front } = this.stage;
    const box = boxOf(route.holds, tables);
    if (!front || box.isEmpty()) return;
    const way = new Vector3();
    for (const id of route.holds) {
      const normal = tables.holds.get(id)?.normal;
      if (normal) way.add(new Vector3(...normal).setZ(0));
    }
    const room = Math.max(0.08 * box.getSize(new Vector3()).length(), this.unit(tables) * 0.25);
    const places = route.holds.flatMap((id) => {
      const place = tables.holds.get(id)?.position;
      return place ? [-room, room].map((d) => new Vector3(...place).addScalar(d)) : [];
    });
    this.stage.frame(places, between(way, front.direction), animate, this.insets());
    this.again = (smooth) => this.route(route, tables, smooth);
    this.shown = "route";
  }

  /** From where a climber stands before the start, as far back as the route is tall. */
  climber(route: Route | undefined, tables: Tables): void {
    const { front } = this.stage;
    if (!front) return;
    const unit = this.unit(tables);
    const starts = route?.start?.length ? route.start : (route?.holds.slice(0, 1) ?? []);
    const box = boxOf(starts, tables);
    const at = (box.isEmpty() ? front.box : box).getCenter(new Vector3());
    const eye = front.floor + EYES * unit;
    const seen = (route?.holds ?? []).flatMap((id) => tables.holds.get(id)?.position ?? []);
    if (seen.length === 0) seen.push(at.x, at.y, front.box.max.z, at.x, at.y, front.floor);
    const sights: Sight[] = [];
    for (let k = 0; k < seen.length; k += 3) {
      const place = new Vector3(...seen.slice(k, k + 3));
      sights.push({ out: place.sub(at).dot(front.direction), up: place.z + at.z + 0.2 * unit - eye });
    }
    const { away, slope } = this.sight(sights, unit);
    const place = at.clone().addScaledVector(front.direction, away).setZ(eye);
    const target = place.clone().addScaledVector(front.direction, -away);
    target.z += slope * away;
    this.let();
    this.stage.moveTo(place, target, true);
  }

  /** How far a climber stands back and how steeply the picture looks up, to see it all. */
  private sight(sights: Sight[], unit: number): { away: number; slope: number } {
    const { top, bottom } = this.insets();
    const { clientHeight } = this.stage.canvas;
    const tan = Math.tan((this.stage.camera.fov * Math.PI) / 360);
    const edge = (share: number): number => Math.atan(tan * share);
    const [under, over] = [edge((2 * bottom) / clientHeight - 1), edge(1 - (2 * top) / clientHeight)];
    for (let away = NEAR * unit; ; away += 0.1 * unit) {
      const angles = sights.map(({ out, up }) => Math.atan2(up, Math.max(away - out, 0.1 * unit)));
      const [low, high] = [Math.min(...angles), Math.max(...angles)];
      if (high - low > over - under && away < FAR * unit) continue;
      return { away, slope: Math.tan((high + low - over - under) / 2) };
    }
  }

  /** Closer to a place of the wall. */
  closer(place: Vector3): void {
    const { front, camera } = this.stage;
    if (!front) return;
    const near = front.box.getSize(new Vector3()).length() * 0.14;
    const way = camera.position.clone().sub(place);
    const distance = Math.min(way.length() * 0.5, Math.max(near, way.length() * 0.25));
    this.let();
    this.stage.moveTo(place.clone().addScaledVector(way.normalize(), distance), place, true);
  }

  /** Eye and target, as in a link. */
  exactly(camera: number[], animate: boolean): void {
    const [a, b, c, d, e, f] = camera as [number, number, number, number, number, number];
    this.let();
    this.stage.moveTo(new Vector3(a, b, c), new Vector3(d, e, f), animate);
  }

  /** A metre; of a scan without a scale, what would be one if the wall were 4 m tall. */
  private unit(tables: Tables): number {
    const { box } = this.stage.front!;
    return tables.metric ? 1 : Math.max(box.max.z - box.min.z, 1e-6) / 4;
  }
}

function boxOf(ids: number[], tables: Tables): Box3 {
  const box = new Box3();
  for (const id of ids) {
    const place: Vec3 | undefined = tables.holds.get(id)?.position;
    if (place) box.expandByPoint(new Vector3(...place));
  }
  return box;
}

/** Between where a route and where the wall faces, so that neither is seen from its edge. */
function between(route: Vector3, wall: Vector3): Vector3 {
  if (route.length() < 1e-6) return wall;
  const way = route.clone().normalize();
  return way.angleTo(wall) > (ASIDE * Math.PI) / 180 ? way : way.add(wall);
}
