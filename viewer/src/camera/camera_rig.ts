/** The camera and its controls: kept before the wall, above the mat and near it. */

import CameraControls from "camera-controls";
import {
  Box3,
  Matrix4,
  PerspectiveCamera,
  Quaternion,
  Raycaster,
  Sphere,
  Spherical,
  Vector2,
  Vector3,
  Vector4,
} from "three";
import type { Vec3 } from "../data/types";
import { fitPlaces } from "./fit";
import type { Insets } from "./fit";
import { RISE } from "./framing";
import type { Framing } from "./framing";

CameraControls.install({
  THREE: {
    Box3,
    Matrix4,
    Quaternion,
    Raycaster,
    Sphere,
    Spherical,
    Vector2,
    Vector3,
    Vector4,
  },
});

const LIFT = 0.2; // metres that the camera keeps above the mat

export class CameraRig {
  readonly camera = new PerspectiveCamera(50, 1, 0.02, 400);
  readonly controls: CameraControls;
  /** Null before a wall stands. */
  framing: Framing | null = null;

  /** `calm`: moves are jumps; `redraw`: called once the camera was sent elsewhere. */
  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly calm: boolean,
    private readonly redraw: () => void,
  ) {
    this.camera.up.set(0, 0, 1);
    this.controls = new CameraControls(this.camera, canvas);
    this.controls.updateCameraUp();
    this.controls.smoothTime = calm ? 0.001 : 0.22;
    this.controls.draggingSmoothTime = 0.06;
    this.controls.dollyToCursor = true;
  }

  /** Look at a wall from its framing; `box` is all of its surface. */
  limit(framing: Framing, box: Box3): void {
    this.framing = framing;
    const size = box.getSize(new Vector3()).length();
    const middle = Math.atan2(framing.direction.x, -framing.direction.y);
    this.controls.minAzimuthAngle = middle - framing.swing;
    this.controls.maxAzimuthAngle = middle + framing.swing;
    this.controls.minDistance = size * 0.01;
    this.controls.maxDistance = size * 2.2;
    this.controls.minPolarAngle = 0.15;
    this.controls.setBoundary(framing.box.clone().expandByScalar(size * 0.02));
    this.camera.near = Math.max(0.005, size * 0.001);
    this.camera.far = size * 6;
    this.camera.updateProjectionMatrix();
  }

  /** Width by height of the canvas. */
  setAspect(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** Move on by some seconds; true if the camera moved. */
  update(seconds: number): boolean {
    this.keepAboveMat();
    return this.controls.update(seconds);
  }

  /** CSS pixels of a place, and whether it is in front of the camera. */
  project(place: Vec3 | Vector3): { x: number; y: number; ahead: boolean } {
    const v = place instanceof Vector3 ? place.clone() : new Vector3(...place);
    v.project(this.camera);
    const { clientWidth, clientHeight } = this.canvas;
    return {
      x: ((v.x + 1) / 2) * clientWidth,
      y: ((1 - v.y) / 2) * clientHeight,
      ahead: v.z < 1,
    };
  }

  /**
   * Look at places from `direction` (horizontal) so that all of them lie in the part of the canvas
   * that nothing covers, as large as they fit.
   */
  frame(places: Vector3[], direction: Vector3, animate: boolean, insets: Insets): void {
    if (places.length === 0) return;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const tan = Math.tan((this.camera.fov * Math.PI) / 360);
    const lens = { width, height, tan, least: this.controls.minDistance * 2 };
    const level = direction.clone().setZ(0).normalize();
    // An overhang is looked at from below, as far as the mat lets the camera down.
    for (let rise = this.framing?.rise ?? RISE; ; rise = Math.min(RISE, rise + 0.05)) {
      const { eye, target } = fitPlaces(places, level.clone().setZ(rise).normalize(), insets, lens);
      if (rise < RISE && this.framing && eye.z < this.framing.floor + LIFT) continue;
      this.moveTo(eye, target, animate);
      return;
    }
  }

  moveTo(eye: Vector3, target: Vector3, animate: boolean): void {
    const smooth = animate && !this.calm;
    void this.controls.setLookAt(eye.x, eye.y, eye.z, target.x, target.y, target.z, smooth);
    this.redraw();
  }

  /** Look from as far aside as the wall may be turned by hand at -1 and 1, from the front at 0. */
  swing(share: number): void {
    if (!this.framing) return;
    const { minAzimuthAngle, maxAzimuthAngle } = this.controls;
    const part = (Math.min(Math.max(share, -1), 1) + 1) / 2;
    void this.controls.rotateAzimuthTo(minAzimuthAngle + part * (maxAzimuthAngle - minAzimuthAngle), false);
    this.redraw();
  }

  /** Eye and target, six numbers in the scan's frame; null before a wall stands. */
  get place(): number[] | null {
    if (!this.framing) return null;
    const eye = this.controls.getPosition(new Vector3());
    const target = this.controls.getTarget(new Vector3());
    return [...eye.toArray(), ...target.toArray()];
  }

  /** The steepest look up from below that keeps the camera above the mat. */
  private keepAboveMat(): void {
    if (!this.framing) return;
    const target = this.controls.getTarget(new Vector3(), false);
    const room = target.z - this.framing.floor - LIFT;
    const cosine = Math.max(-1, Math.min(1, -room / Math.max(this.controls.distance, 1e-6)));
    this.controls.maxPolarAngle = Math.min(Math.PI - 0.15, Math.max(0.2, Math.acos(cosine)));
  }
}
