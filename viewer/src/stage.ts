/** The 3D picture: renderer, camera, picking and outlines. Draws only when something changed. */

import CameraControls from "camera-controls";
import {
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
import type { Material, ShaderMaterial } from "three";
import { MeshBVH } from "three-mesh-bvh";
import { frontOf } from "./front";
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
  private pickers: Picker[] = [];
  private outlined = false;
  private fadeGoal = 0;
  private dirty = true;
  private request = 0;
  private last = 0;
  private readonly calm: boolean;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "default" });
    this.renderer.autoClear = false;
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
    canvas.addEventListener("webglcontextlost", () => this.onLost(true));
    canvas.addEventListener("webglcontextrestored", () => {
      this.onLost(false);
      this.state.commit();
      this.renderer.setClearColor(this.look.uBackdrop.value, 1);
      this.redraw();
    });
    this.tick = this.tick.bind(this);
    this.request = requestAnimationFrame(this.tick);
  }

  /** Show a wall; a later, finer tier keeps the camera, the state and the picking surface. */
  show(wall: Wall, refine: boolean): void {
    for (const { mesh, drawn, masked } of this.meshes) {
      this.scene.remove(mesh);
      (drawn as ShaderMaterial).uniforms["uMap"]?.value?.dispose();
      mesh.geometry.dispose();
      drawn.dispose();
      masked.dispose();
    }
    if (!refine) {
      this.state.dispose();
      this.state = new HoldState(Math.max(wall.most, ...wall.tables.holds.keys(), 0));
      this.look.uState.value = this.state.texture;
      this.pickers = wall.parts.map(({ geometry }) => ({
        bvh: new MeshBVH(geometry, { targetLeafSize: 8 }),
        features: geometry.getAttribute("feature").array,
        index: geometry.getIndex()!.array,
      }));
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
  }

  resize(width: number, height: number): void {
    if (width < 1 || height < 1) return;
    const dense = Math.min(devicePixelRatio || 1, 2);
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

  /** What lies under a point of the canvas, in CSS pixels from its top left. */
  pick(x: number, y: number): Hit | null {
    const { clientWidth, clientHeight } = this.canvas;
    const at = new Vector2((x / clientWidth) * 2 - 1, 1 - (y / clientHeight) * 2);
    this.ray.setFromCamera(at, this.camera);
    let best: Hit | null = null;
    let nearest = Infinity;
    this.pickers.forEach(({ bvh, features, index }, part) => {
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
   * Look at places from `direction` (horizontal), so that all of them are in the picture;
   * `covered` is the share of the picture's height that a card hides at the bottom.
   */
  frame(
    places: Vector3[],
    direction: Vector3,
    animate: boolean,
    { margin = 1.12, covered = 0 } = {},
  ): void {
    if (places.length === 0) return;
    const way = direction.clone().setZ(0).normalize();
    way.z = this.front?.rise ?? 0.12;
    way.normalize();
    const right = new Vector3(0, 0, 1).cross(way).normalize();
    const up = way.clone().cross(right);
    // The middle of the picture's extent, not of the box: walls run at an angle to the axes.
    const box = new Box3();
    for (const p of places) box.expandByPoint(new Vector3(p.dot(right), p.dot(up), p.dot(way)));
    const middle = box.getCenter(new Vector3());
    const tan = Math.tan((this.camera.fov * Math.PI) / 360);
    let distance = 0;
    for (const p of places) {
      const ahead = p.dot(way) - middle.z;
      const high = (Math.abs(p.dot(up) - middle.y) / (tan * (1 - covered))) * margin;
      const wide = (Math.abs(p.dot(right) - middle.x) / (tan * this.camera.aspect)) * margin;
      distance = Math.max(distance, ahead + high, ahead + wide);
    }
    const target = new Vector3()
      .addScaledVector(right, middle.x)
      .addScaledVector(up, middle.y)
      .addScaledVector(way, middle.z);
    distance = Math.max(distance, this.controls.minDistance * 2);
    target.addScaledVector(up, -covered * tan * distance);
    this.moveTo(target.clone().addScaledVector(way, distance), target, animate);
  }

  moveTo(eye: Vector3, target: Vector3, animate: boolean): void {
    const smooth = animate && !this.calm;
    void this.controls.setLookAt(eye.x, eye.y, eye.z, target.x, target.y, target.z, smooth);
    this.redraw();
  }

  home(animate: boolean): void {
    if (this.front) this.frame(this.front.places, this.front.direction, animate);
  }

  /** The picture as PNG. */
  screenshot(): Promise<Blob | null> {
    this.draw();
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }

  dispose(): void {
    cancelAnimationFrame(this.request);
    this.controls.dispose();
    for (const { mesh, drawn, masked } of this.meshes) {
      mesh.geometry.dispose();
      drawn.dispose();
      masked.dispose();
    }
    this.mask.dispose();
    this.state.dispose();
    this.renderer.dispose();
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
    this.request = requestAnimationFrame(this.tick);
    const seconds = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    this.keepAboveMat();
    const moved = this.controls.update(seconds);
    const fade = this.look.uFade;
    if (fade.value !== this.fadeGoal) {
      fade.value = Math.min(1, fade.value + seconds * 5);
      this.dirty = true;
    }
    if (!moved && !this.dirty) return;
    this.draw();
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
