/** Views to which the camera moves by itself: the whole wall, a route, a climber's eyes. */

import { Box3, Vector3 } from "three";
import type { Route, Tables, Vec3 } from "../data/types";
import type { CameraRig } from "./camera_rig";
import { standFor } from "./climber_stand";
import { freeBox } from "./fit";
import type { Insets } from "./fit";

const EYES = 1.65; // metres over the mat
const NEAR = 2.2; // metres that a climber stands from the start, at least
const FAR = 20; // and at most: it is worth more to see the whole route than to stand where one would
const ASIDE = 70; // degrees from the wall's front that a route is looked at from, at most

export class CameraViews {
  /** Repeats the present view for a canvas of another size; null once the camera was moved by hand. */
  private again: ((animate: boolean) => void) | null = null;
  private shown: "wall" | "route" | null = null;

  constructor(
    private readonly rig: CameraRig,
    private readonly insets: () => Insets,
  ) {
    // Not at "controlstart": a tap moves nothing.
    rig.controls.addEventListener("control", () => this.markMoved());
  }

  /** The subject to which the camera moved by itself; null after somebody moved it. */
  get subject(): "wall" | "route" | null {
    return this.shown;
  }

  /** The camera was moved by hand: a new size of the canvas leaves it where it is. */
  markMoved(): void {
    this.again = null;
    this.shown = null;
  }

  /** Repeat the view, because the free part of the canvas has changed. */
  refit(animate: boolean): void {
    this.again?.(animate);
  }

  /** The whole wall, from the framing. */
  wall(animate: boolean): void {
    const { framing } = this.rig;
    if (!framing) return;
    this.rig.frame(framing.places, framing.direction, animate, this.insets());
    this.again = (smooth) => this.wall(smooth);
    this.shown = "wall";
  }

  /** As far aside as the wall may be turned by hand at -1 and 1; the distance stays. */
  swing(share: number): void {
    this.rig.swing(share);
  }

  /** A route, and other places besides its holds. */
  route(route: Pick<Route, "holds">, tables: Tables, animate = true, besides: Vector3[] = []): void {
    const { framing } = this.rig;
    const box = boxOf(route.holds, tables);
    if (!framing || box.isEmpty()) return;
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
    this.rig.frame([...places, ...besides], between(way, framing.direction), animate, this.insets());
    this.again = (smooth) => this.route(route, tables, smooth, besides);
    this.shown = "route";
  }

  /** From where a climber stands before the start, as far back as all of the route is seen. */
  climber(route: Route | undefined, tables: Tables, animate = true): void {
    const { framing, canvas, camera } = this.rig;
    if (!framing) return;
    const unit = this.unit(tables);
    const starts = route?.start?.length ? route.start : (route?.holds.slice(0, 1) ?? []);
    const box = boxOf(starts, tables);
    const at = (box.isEmpty() ? framing.box : box).getCenter(new Vector3());
    const eye = framing.floor + EYES * unit;
    const right = new Vector3(0, 0, 1).cross(framing.direction);
    const places = this.placesToSee(route, tables, at).map((place) => {
      const way = place.clone().sub(at);
      return { out: way.dot(framing.direction), side: way.dot(right), up: place.z - eye };
    });
    const tall = Math.tan((camera.fov * Math.PI) / 360);
    const free = freeBox(this.insets(), canvas.clientWidth, canvas.clientHeight);
    const lens = { tall, wide: tall * camera.aspect, free };
    const { away, heading, pitch } = standFor(places, lens, NEAR * unit, FAR * unit);
    const place = at.clone().addScaledVector(framing.direction, away).setZ(eye);
    const target = place
      .clone()
      .addScaledVector(framing.direction, -away * Math.cos(heading))
      .addScaledVector(right, away * Math.sin(heading));
    target.z += Math.tan(pitch) * away;
    this.markMoved();
    this.rig.moveTo(place, target, animate);
    this.again = (smooth) => this.climber(route, tables, smooth);
  }

  /** The places that a climber wants to see: the route's holds with room for their size and flags, or the wall. */
  private placesToSee(route: Route | undefined, tables: Tables, at: Vector3): Vector3[] {
    const { framing } = this.rig;
    const holds = (route?.holds ?? []).flatMap((id) => tables.holds.get(id) ?? []);
    if (holds.length === 0) return [at.clone().setZ(framing!.box.max.z), at.clone().setZ(framing!.floor)];
    return holds.flatMap(({ position, size_m }) => {
      const room = 0.6 * (size_m ?? 0.1 * this.unit(tables));
      return [-room, room].flatMap((d) => {
        const place = new Vector3(...position);
        return [place.clone().setZ(place.z + d), place.clone().setX(place.x + d)];
      });
    });
  }

  /** Closer to a place of the wall. */
  closer(place: Vector3): void {
    const { framing, camera } = this.rig;
    if (!framing) return;
    const near = framing.box.getSize(new Vector3()).length() * 0.14;
    const way = camera.position.clone().sub(place);
    const distance = Math.min(way.length() * 0.5, Math.max(near, way.length() * 0.25));
    this.markMoved();
    this.rig.moveTo(place.clone().addScaledVector(way.normalize(), distance), place, true);
  }

  /** As far from a place of the wall as before, straight before it. */
  private turnTo(place: Vector3): void {
    const { controls } = this.rig;
    const eye = controls.getPosition(new Vector3());
    const way = place.clone().sub(controls.getTarget(new Vector3()));
    this.markMoved();
    this.rig.moveTo(eye.add(way), place, true);
  }

  /** Turn to a place that the picture does not show. */
  bringIn(place: Vector3): void {
    const { x, y, ahead } = this.rig.project(place);
    const { clientWidth, clientHeight } = this.rig.canvas;
    if (!ahead || x < 0 || y < 0 || x > clientWidth || y > clientHeight) this.turnTo(place);
  }

  /** Eye and target, as in a link. */
  lookFrom(camera: number[], animate: boolean): void {
    const [a, b, c, d, e, f] = camera as [number, number, number, number, number, number];
    this.markMoved();
    this.rig.moveTo(new Vector3(a, b, c), new Vector3(d, e, f), animate);
  }

  /** A metre; of a scan without a scale, what would be one if the wall were 4 m tall. */
  private unit(tables: Tables): number {
    const { box } = this.rig.framing!;
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
