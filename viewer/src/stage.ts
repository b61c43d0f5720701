/** The 3D picture: renderer, camera, picking and outlines. Draws only when something changed. */

import CameraControls from "camera-controls";
import {
  Box2,
  Box3,
  Color,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  NearestFilter,
  PerspectiveCamera,
  PlaneGeometry,
  Quaternion,
  Raycaster,
  Scene,
  Sphere,
  SphereGeometry,
  Spherical,
  Vector2,
  Vector3,
  Vector4,
  WebGLRenderTarget,
  WebGLRenderer,
} from "three";
import type { BufferAttribute, BufferGeometry, Material, ShaderMaterial, Texture } from "three";
import { MeshBVH } from "three-mesh-bvh";
import { bordersOf } from "./borders";
import { frontOf, RISE } from "./front";
import type { Front } from "./front";
import type { Wall } from "./load";
import { maskMaterial, outlineMaterial, wallMaterial } from "./shaders";
import type { WallLook } from "./shaders";
import { HoldState } from "./state";
import type { Vec3 } from "./types";

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

export interface Hit {
  point: Vector3;
  hold: number;
  part: number;
  /** Triangle in the part's (reordered) index. */
  triangle: number;
}

interface Picker {
  bvh: MeshBVH;
  features: ArrayLike<number>;
  index: ArrayLike<number>;
}

/** What of a canvas nothing covers, in -1..1 from its left bottom. */
export function freeBox(insets: Insets, width: number, height: number): Box2 {
  return new Box2(
    new Vector2((2 * insets.left) / width - 1, (2 * insets.bottom) / height - 1),
    new Vector2(1 - (2 * insets.right) / width, 1 - (2 * insets.top) / height),
  );
}

/** CSS pixels at each side of the canvas that something else covers. */
export interface Insets {
  top: number;
  right: number;
  bottom: number;
  left: number;
}

/**
 * Where a camera looks so that places fill the free part of the canvas. Places and the found target
 * are along right, up and towards the camera; `tan` is that of half the vertical field of view.
 */
function fit(
  places: Vector3[],
  insets: Insets,
  lens: { width: number; height: number; tan: number; least: number },
): { x: number; y: number; z: number; distance: number } {
  const free = freeBox(insets, lens.width, lens.height);
  const room = free.getSize(new Vector2()).max(new Vector2(0.1, 0.1));
  const aim = free.getCenter(new Vector2());
  const box = new Box3().setFromPoints(places);
  const { x, y, z } = box.getCenter(new Vector3());
  const found = { x, y, z, distance: box.getSize(new Vector3()).length() + lens.least };
  const wide = (lens.tan * lens.width) / lens.height;
  const drawn = new Box2();
  // Perspective makes the exact answer an equation; a few steps from near it settle it.
  for (let step = 0; step < 8; step++) {
    drawn.makeEmpty();
    for (const place of places) {
      const ahead = Math.max(1e-6, found.distance - (place.z - found.z));
      const across = (place.x - found.x) / (ahead * wide);
      drawn.expandByPoint(new Vector2(across, (place.y - found.y) / (ahead * lens.tan)));
    }
    const size = drawn.getSize(new Vector2());
    const middle = drawn.getCenter(new Vector2());
    const grow = Math.max(size.x / room.x, size.y / room.y, 1e-3);
    found.distance = Math.max(lens.least, found.distance * grow);
    found.x += (middle.x - aim.x) * wide * found.distance;
    found.y += (middle.y - aim.y) * lens.tan * found.distance;
  }
  return found;
}

const SHAPE_AFTER = 50; // milliseconds, so that a tier is drawn before its borders are smoothed
const SLICE = 12; // milliseconds of that between two looks at what the page wants
const LIFT = 0.2; // metres that the camera keeps above the mat

export class Stage {
  readonly renderer: WebGLRenderer;
  readonly camera = new PerspectiveCamera(50, 1, 0.02, 400);
  readonly controls: CameraControls;
  state = new HoldState(0);
  front: Front | null = null;
  /** Called after each drawn frame, to move what lies over the picture. */
  onFrame: () => void = () => {};
  onLost: (lost: boolean) => void = () => {};
  frames = 0;

  private readonly scene = new Scene();
  private readonly overlay = new Scene();
  private readonly strokes = new Scene();
  private readonly mask: WebGLRenderTarget;
  private readonly ink: ShaderMaterial;
  private readonly look: WallLook;
  private readonly ray = new Raycaster();
  private meshes: { mesh: Mesh; drawn: Material; masked: Material }[] = [];
  private surface: BufferGeometry[] = [];
  private pickers: Picker[] | null = null;
  private outlined = false;
  private fadeGoal = 0;
  private dirty = true;
  /** The frame that is asked for; 0 while nothing moves: then no frame is asked for at all. */
  private request = 0;
  private last = 0;
  private size = "";
  /** Not 0 while the borders of the present tier are not smooth yet. */
  private shaping = 0;
  private readonly gone = new AbortController();
  private readonly calm: boolean;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "default" });
    this.renderer.autoClear = false;
    // Asking how a shader was compiled makes the page wait for it.
    this.renderer.debug.checkShaderErrors = false;
    this.camera.up.set(0, 0, 1);
    this.controls = new CameraControls(this.camera, canvas);
    this.controls.updateCameraUp();
    this.calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.smoothTime = this.calm ? 0.001 : 0.22;
    this.controls.draggingSmoothTime = 0.06;
    this.controls.dollyToCursor = true;
    this.look = {
      uState: { value: this.state.texture },
      uFade: { value: 0 },
      uBackdrop: { value: new Color("#ffffff") },
    };
    // Marks must not blend into each other: nearest, not linear.
    this.mask = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
    this.ink = outlineMaterial(this.mask.texture);
    const quad = new Mesh(new PlaneGeometry(2, 2), this.ink);
    quad.frustumCulled = false;
    this.overlay.add(quad);
    const { signal } = this.gone;
    canvas.addEventListener("webglcontextlost", () => this.onLost(true), { signal });
    const restored = (): void => {
      this.onLost(false);
      this.state.commit();
      this.renderer.setClearColor(this.look.uBackdrop.value, 1);
      this.redraw();
    };
    canvas.addEventListener("webglcontextrestored", restored, { signal });
    this.tick = this.tick.bind(this);
    const wake = (): void => this.wake();
    for (const type of ["controlstart", "control", "transitionstart"] as const) {
      this.controls.addEventListener(type, wake);
    }
    this.redraw();
  }

  /** Show a wall; a later, finer tier keeps the camera, the state and the picking surface. */
  show(wall: Wall, refine: boolean): void {
    this.clear();
    if (!refine) {
      this.state.dispose();
      let most = wall.most;
      for (const id of wall.tables.holds.keys()) if (id > most) most = id;
      this.state = new HoldState(most);
      this.look.uState.value = this.state.texture;
      this.surface = wall.parts.map(({ geometry }) => geometry);
      this.pickers = null;
    }
    const most = this.renderer.capabilities.getMaxAnisotropy();
    this.meshes = wall.parts.map((part) => {
      if (part.map) part.map.anisotropy = Math.min(8, most);
      const drawn = wallMaterial(part, this.look);
      const masked = maskMaterial(this.look);
      const mesh = new Mesh(part.geometry, drawn);
      this.scene.add(mesh);
      return { mesh, drawn, masked };
    });
    if (!refine) {
      this.front = frontOf(wall);
      this.limit(wall.box);
    }
    this.redraw();
    const jobs = wall.most > 0 ? wall.parts.map(({ geometry }) => geometry) : [];
    this.shaping = setTimeout(() => void this.shape(jobs), SHAPE_AFTER);
  }

  /** Smooth borders of a tier's holds, found a few milliseconds at a time. */
  private async shape(geometries: BufferGeometry[]): Promise<void> {
    const tier = this.shaping;
    for (const geometry of geometries) {
      const steps = bordersOf(geometry);
      let step = steps.next();
      for (let began = performance.now(); !step.done; step = steps.next()) {
        if (performance.now() - began < SLICE) continue;
        await new Promise((resolve) => setTimeout(resolve));
        if (tier !== this.shaping) return; // another tier has come, or the element is gone
        began = performance.now();
      }
      for (const [name, values] of [["near", step.value.near], ["depth", step.value.inside]] as const) {
        const attribute = geometry.getAttribute(name) as BufferAttribute;
        attribute.copyArray(values);
        attribute.needsUpdate = true;
      }
    }
    this.shaping = 0;
    this.redraw();
  }

  /** Free what the GPU holds of the present tier. */
  private clear(): void {
    clearTimeout(this.shaping);
    this.shaping = 0;
    for (const { mesh, drawn, masked } of this.meshes) {
      this.scene.remove(mesh);
      const map = (drawn as ShaderMaterial).uniforms["uMap"]?.value as Texture | null;
      map?.dispose();
      // A decoded picture stays in memory until it is collected, unless it is closed.
      if (typeof ImageBitmap !== "undefined" && map?.image instanceof ImageBitmap) map.image.close();
      mesh.geometry.dispose();
      drawn.dispose();
      masked.dispose();
    }
    this.meshes = [];
  }

  /** Full colour only for `lit`; none: everything. Outlines as given, by hold id. */
  paint(lit: Set<number> | null, outlines: Map<number, number>): void {
    for (let id = 0; id < this.state.count; id++) {
      this.state.write(id, lit === null || lit.has(id), outlines.get(id) ?? 0);
    }
    this.state.commit();
    this.outlined = outlines.size > 0;
    this.fadeGoal = lit === null ? 0 : 1;
    if (lit === null || this.calm) this.look.uFade.value = this.fadeGoal;
    this.redraw();
  }

  backdrop(colour: string): void {
    this.look.uBackdrop.value.set(colour);
    this.renderer.setClearColor(new Color(colour), 1);
    this.redraw();
  }

  redraw(): void {
    this.dirty = true;
    this.wake();
  }

  /** Draw what was asked for now rather than in the next frame. */
  drawNow(): void {
    this.keepAboveMat();
    this.controls.update(0.001); // seconds; no time at all would divide by it
    this.draw();
  }

  private wake(): void {
    if (this.request !== 0 || this.gone.signal.aborted) return;
    this.last = 0;
    this.request = requestAnimationFrame(this.tick);
  }

  /** A resized canvas is blank until it is drawn: `drawNow` when the camera is where it should be. */
  resize(width: number, height: number): void {
    const dense = Math.min(devicePixelRatio || 1, 2);
    const size = `${width} ${height} ${dense}`;
    if (width < 1 || height < 1 || size === this.size) return;
    this.size = size;
    this.renderer.setPixelRatio(dense);
    this.renderer.setSize(width, height, false);
    this.mask.setSize(Math.round(width * dense), Math.round(height * dense));
    this.ink.uniforms["uDense"]!.value = dense;
    this.ink.uniforms["uPixel"]!.value.set(1 / this.mask.width, 1 / this.mask.height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.redraw();
  }

  /** Show a painted ball where it meets the wall; gives the way to take it away. */
  paintBall(centre: Vector3, radius: number, colour: string): () => void {
    const look = { color: new Color(colour), transparent: true, opacity: 0.6, depthWrite: false };
    const ball = new Mesh(new SphereGeometry(radius, 16, 12), new MeshBasicMaterial(look));
    ball.position.copy(centre);
    this.strokes.add(ball);
    this.redraw();
    return () => {
      this.strokes.remove(ball);
      ball.geometry.dispose();
      ball.material.dispose();
      this.redraw();
    };
  }

  /**
   * The search trees of the first tier. They take longer to build than a frame to draw, so that
   * comes first; whoever picks before they are built waits for them.
   */
  preparePicking(): Picker[] {
    this.pickers ??= this.surface.map((geometry) => ({
      bvh: new MeshBVH(geometry, { targetLeafSize: 8 }),
      features: geometry.getAttribute("feature").array,
      index: geometry.getIndex()!.array,
    }));
    return this.pickers;
  }

  /** What lies under a point of the canvas, in CSS pixels from its top left. */
  pick(x: number, y: number): Hit | null {
    const { clientWidth, clientHeight } = this.canvas;
    const at = new Vector2((x / clientWidth) * 2 - 1, 1 - (y / clientHeight) * 2);
    this.ray.setFromCamera(at, this.camera);
    let best: Hit | null = null;
    let nearest = Infinity;
    this.preparePicking().forEach(({ bvh, features, index }, part) => {
      const hit = bvh.raycastFirst(this.ray.ray, 2);
      if (!hit || hit.distance >= nearest || hit.faceIndex == null) return;
      nearest = hit.distance;
      const hold = Math.round(features[index[3 * hit.faceIndex]!]!);
      best = { point: hit.point.clone(), hold, part, triangle: hit.faceIndex };
    });
    return best;
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
    const level = direction.clone().setZ(0).normalize();
    // An overhang is looked at from below, as far as the mat lets the camera down.
    for (let rise = this.front?.rise ?? RISE; ; rise = Math.min(RISE, rise + 0.05)) {
      const { eye, target } = this.fitted(places, level.clone().setZ(rise).normalize(), insets);
      if (rise < RISE && this.front && eye.z < this.front.floor + LIFT) continue;
      this.moveTo(eye, target, animate);
      return;
    }
  }

  /** Eye and target of a look along -`way` that shows places as large as they fit. */
  private fitted(
    places: Vector3[],
    way: Vector3,
    insets: Insets,
  ): { eye: Vector3; target: Vector3 } {
    const right = new Vector3(0, 0, 1).cross(way).normalize();
    const up = way.clone().cross(right);
    const flat = places.map((p) => new Vector3(p.dot(right), p.dot(up), p.dot(way)));
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const tan = Math.tan((this.camera.fov * Math.PI) / 360);
    const least = this.controls.minDistance * 2;
    const found = fit(flat, insets, { width, height, tan, least });
    const target = new Vector3()
      .addScaledVector(right, found.x)
      .addScaledVector(up, found.y)
      .addScaledVector(way, found.z);
    return { eye: target.clone().addScaledVector(way, found.distance), target };
  }

  moveTo(eye: Vector3, target: Vector3, animate: boolean): void {
    const smooth = animate && !this.calm;
    void this.controls.setLookAt(eye.x, eye.y, eye.z, target.x, target.y, target.z, smooth);
    this.redraw();
  }

  /** The picture as PNG. */
  screenshot(): Promise<Blob | null> {
    this.draw();
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }

  /** What the GPU holds, counted. */
  get memory(): { geometries: number; textures: number } {
    const { geometries, textures } = this.renderer.info.memory;
    return { geometries, textures };
  }

  dispose(): void {
    this.gone.abort();
    cancelAnimationFrame(this.request);
    this.request = 0;
    this.controls.dispose();
    this.clear();
    this.mask.dispose();
    this.ink.dispose();
    this.state.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.surface = [];
    this.pickers = null;
  }

  /** Keep the camera in front of the wall, above the mat, and near it. */
  private limit(box: Box3): void {
    const front = this.front!;
    const size = box.getSize(new Vector3()).length();
    const middle = Math.atan2(front.direction.x, -front.direction.y);
    this.controls.minAzimuthAngle = middle - front.swing;
    this.controls.maxAzimuthAngle = middle + front.swing;
    this.controls.minDistance = size * 0.01;
    this.controls.maxDistance = size * 2.2;
    this.controls.minPolarAngle = 0.15;
    this.controls.setBoundary(front.box.clone().expandByScalar(size * 0.02));
    this.camera.near = Math.max(0.005, size * 0.001);
    this.camera.far = size * 6;
    this.camera.updateProjectionMatrix();
  }

  /** The steepest look up from below that keeps the camera above the mat. */
  private keepAboveMat(): void {
    if (!this.front) return;
    const target = this.controls.getTarget(new Vector3(), false);
    const room = target.z - this.front.floor - LIFT;
    const cosine = Math.max(-1, Math.min(1, -room / Math.max(this.controls.distance, 1e-6)));
    this.controls.maxPolarAngle = Math.min(Math.PI - 0.15, Math.max(0.2, Math.acos(cosine)));
  }

  private tick(now: number): void {
    const seconds = this.last === 0 ? 1 / 60 : Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    this.keepAboveMat();
    const moved = this.controls.update(seconds);
    const fade = this.look.uFade;
    if (fade.value !== this.fadeGoal) {
      fade.value = Math.min(1, fade.value + seconds * 5);
      this.dirty = true;
    }
    const busy = moved || this.dirty;
    if (busy) this.draw();
    this.request = busy ? requestAnimationFrame(this.tick) : 0;
  }

  private draw(): void {
    if (this.renderer.getContext().isContextLost()) return;
    this.dirty = false;
    this.renderer.setRenderTarget(null);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    if (this.strokes.children.length) this.renderer.render(this.strokes, this.camera);
    if (this.outlined) this.drawOutlines();
    this.frames++;
    this.onFrame();
  }

  private drawOutlines(): void {
    const clear = this.renderer.getClearColor(new Color());
    this.ink.uniforms["uStrength"]!.value = 1;
    for (const item of this.meshes) item.mesh.material = item.masked;
    this.renderer.setRenderTarget(this.mask);
    this.renderer.setClearColor(0x000000, 1);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    for (const item of this.meshes) item.mesh.material = item.drawn;
    this.renderer.setRenderTarget(null);
    this.renderer.setClearColor(clear, 1);
    this.renderer.render(this.overlay, this.camera);
  }
}
