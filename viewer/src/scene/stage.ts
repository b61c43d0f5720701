/** The 3D picture: renderer, picking and outlines. Draws only when something changed. */

import {
  BufferGeometry,
  Color,
  DirectionalLight,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  Object3D,
  Raycaster,
  Scene,
  SphereGeometry,
  Texture,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { CameraRig } from "../camera/camera_rig";
import type { Labels } from "../geometry/labels";
import { Picking } from "../input/picking";
import type { Hit } from "../input/picking";
import type { WallModel } from "../tiers/read_wall";
import { uploadTexture } from "../tiers/texture_upload";
import { WorkerClient } from "../tiers/worker_client";
import { HoldState } from "./hold_state";
import { wallMaterial } from "./materials";
import type { WallLook } from "./materials";
import { Outlines } from "./outlines";
import { TierMeshes, highestId } from "./tier_meshes";

export class Stage {
  readonly renderer: WebGLRenderer;
  readonly rig: CameraRig;
  state = new HoldState(0);
  /** Called after each drawn frame, to move what lies over the picture. */
  onFrame: () => void = () => {};
  onLost: (lost: boolean) => void = () => {};
  /** Called when pictures that were sent are gone with the GPU's memory. */
  onBlank: () => void = () => {};
  frames = 0;

  private readonly scene = new Scene();
  private readonly strokes = new Scene();
  /** Stands before the wall, over the outlines of holds. */
  private readonly added = new Scene();
  private readonly outlines = new Outlines();
  private readonly look: WallLook;
  private readonly ray = new Raycaster();
  private meshes: TierMeshes | null = null;
  private picking: Picking | null = null;
  private background: WorkerClient | null = null;
  /** Labels that are shown; null: those that the file itself has. */
  private labels: Labels | null = null;
  private outlined = false;
  private lit = false;
  private fadeGoal = 0;
  private dirty = true;
  /** The requested frame; 0 while nothing moves, because then no frame is requested. */
  private request = 0;
  private last = 0;
  private size = "";
  /** The borders of the present tier are not smooth yet. */
  shaping = false;
  /** Pictures are missing; they are on their way. */
  blank = false;
  /** File of what is shown. */
  shown: string | null = null;
  /** How often the GPU's memory came back empty, and as often when pictures were sent last. */
  private restored = 0;
  private sent = 0;
  private readonly gone = new AbortController();
  private readonly calm: boolean;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "default" });
    this.renderer.autoClear = false;
    // Asking how a shader was compiled makes the page wait for it.
    this.renderer.debug.checkShaderErrors = false;
    this.calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.rig = new CameraRig(canvas, this.calm, () => this.redraw());
    this.look = {
      uState: { value: this.state.texture },
      uFade: { value: 0 },
      uBackdrop: { value: new Color("#ffffff") },
    };
    const { signal } = this.gone;
    canvas.addEventListener("webglcontextlost", () => this.onLost(true), { signal });
    const restored = (): void => {
      this.restored++;
      this.onLost(false);
      this.wanting();
      this.state.commit();
      this.renderer.setClearColor(this.look.uBackdrop.value, 1);
      this.redraw();
    };
    canvas.addEventListener("webglcontextrestored", restored, { signal });
    // A page that was left may be kept for "Back"; it shall keep none of the GPU's memory meanwhile.
    window.addEventListener("pagehide", () => this.renderer.forceContextLoss(), { signal });
    const back = ({ persisted }: PageTransitionEvent): void => {
      if (persisted) this.renderer.forceContextRestore();
    };
    window.addEventListener("pageshow", back, { signal });
    this.tick = this.tick.bind(this);
    this.warm();
    const wake = (): void => this.wake();
    for (const type of ["controlstart", "control", "transitionstart"] as const) {
      this.rig.controls.addEventListener(type, wake);
    }
    this.redraw();
  }

  /**
   * Have the GPU compile what walls are drawn with while their file is on its way. This program stays, so
   * that a finer tier waits for none.
   */
  private warm(): void {
    const scene = new Scene();
    const look = wallMaterial({ map: new Texture(), coloured: false }, this.look);
    scene.add(new Mesh(new BufferGeometry(), look));
    this.renderer.compile(scene, this.rig.camera);
  }

  /** Send a wall's pictures to the GPU, from the worker that read it; before it is shown. */
  async prepare({ parts }: WallModel, reader: WorkerClient, signal: AbortSignal): Promise<void> {
    this.sent = this.restored;
    for (const { map, picture } of parts) {
      if (map && picture) await uploadTexture(this.renderer, map, picture, reader, signal);
    }
  }

  private wanting(): void {
    this.blank = this.shown !== null;
    if (this.blank) this.onBlank();
  }

  /** Fill the pictures of what is shown anew, from the same file read again. */
  async refill({ source, parts }: WallModel, reader: WorkerClient, signal: AbortSignal): Promise<void> {
    const { restored } = this;
    for (const [part, { picture }] of parts.entries()) {
      const map = source === this.shown ? this.meshes?.parts[part]?.map : null;
      if (map && picture) await uploadTexture(this.renderer, map, picture, reader, signal);
    }
    if (restored === this.restored && source === this.shown) this.blank = false;
    this.redraw();
  }

  /**
   * Show a wall. A later, finer tier keeps the camera, the state and the picking surface; the first is drawn
   * once the camera is where it should be (`drawNow`).
   */
  show(wall: WallModel, refine: boolean): void {
    this.meshes?.dispose();
    this.meshes = new TierMeshes(wall.parts, this.scene, this.look);
    this.shown = wall.source;
    this.blank = false;
    if (this.sent !== this.restored) this.wanting();
    if (!refine) {
      this.labels = wall.labels;
      this.reserve(highestId(wall));
      this.state.reset();
      this.picking = new Picking(wall, this.worker);
      this.rig.limit(wall.framing, wall.box);
    } else {
      this.redraw();
      const { labels } = this;
      this.labels = wall.labels;
      if (labels) this.relabel(labels);
    }
    if (wall.most > 0) this.shape();
  }

  /** Show other labels than the tiers came with. */
  relabel(labels: Labels): void {
    if (this.labels?.equals(labels)) return;
    this.labels = labels;
    this.picking?.relabel(labels);
    if (!this.meshes) return;
    this.meshes.relabel(labels);
    this.redraw();
    this.shape();
  }

  /** Room for ids up to this one. */
  reserve(most: number): void {
    if (most < this.state.count) return;
    this.state.dispose();
    this.state = new HoldState(most);
    this.look.uState.value = this.state.texture;
  }

  /** Begun after the first frame: until then its start would hold up the reader's. */
  private get worker(): WorkerClient {
    return (this.background ??= new WorkerClient());
  }

  private shape(): void {
    this.shaping = true;
    void this.meshes!.shape(this.worker, () => {
      this.shaping = false;
      this.redraw();
    });
  }

  /** Full colour only for `lit`; none: everything. Outlines and heat as given, by hold id. */
  paint(lit: Set<number> | null, outlines: Map<number, number>, heat: Map<number, number>): void {
    for (let id = 0; id < this.state.count; id++) {
      this.state.write(id, lit === null || lit.has(id), outlines.get(id) ?? 0, heat.get(id) ?? 0);
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

  /** Draw now rather than in the next frame. */
  drawNow(): void {
    this.rig.update(0.001); // seconds; no time at all would divide by it
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
    this.renderer.setDrawingBufferSize(width, height, dense); // at once: each new size is a new canvas
    this.outlines.resize(width, height, dense);
    this.rig.setAspect(width / height);
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

  /** Draw something of one's own among the wall. */
  add(object: Object3D): void {
    this.light();
    this.added.add(object);
    this.redraw();
  }

  remove(object: Object3D): void {
    this.added.remove(object);
    this.redraw();
  }

  /** The wall has its light in its picture; what is added to it needs some. */
  private light(): void {
    const { framing } = this.rig;
    if (this.lit || !framing) return;
    this.lit = true;
    const sun = new DirectionalLight("#ffffff", 1.8);
    sun.position.copy(framing.direction).add(new Vector3(0.4, 0, 1));
    this.added.add(new HemisphereLight("#ffffff", "#8a8f98", 1.6), sun);
  }

  /** The place and hold under a point of the canvas, in CSS pixels from its top left; null beside the wall. */
  pick(x: number, y: number): Hit | null {
    const { clientWidth, clientHeight } = this.canvas;
    const at = new Vector2((x / clientWidth) * 2 - 1, 1 - (y / clientHeight) * 2);
    this.ray.setFromCamera(at, this.rig.camera);
    return this.picking?.first(this.ray) ?? null;
  }

  /** The picture as PNG. */
  screenshot(): Promise<Blob | null> {
    this.draw();
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }

  /** Numbers of geometries and textures on the GPU. */
  get memory(): { geometries: number; textures: number } {
    const { geometries, textures } = this.renderer.info.memory;
    return { geometries, textures };
  }

  dispose(): void {
    this.gone.abort();
    cancelAnimationFrame(this.request);
    this.request = 0;
    this.rig.controls.dispose();
    this.background?.end();
    this.meshes?.dispose();
    this.outlines.dispose();
    this.state.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.picking = null;
  }

  private tick(now: number): void {
    const seconds = this.last === 0 ? 1 / 60 : Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    const moved = this.rig.update(seconds);
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
    const { camera } = this.rig;
    this.dirty = false;
    this.renderer.setRenderTarget(null);
    this.renderer.clear();
    this.renderer.render(this.scene, camera);
    if (this.strokes.children.length) this.renderer.render(this.strokes, camera);
    if (this.outlined && this.meshes) this.outlines.draw(this.renderer, this.scene, camera, this.meshes.masks);
    if (this.added.children.length) this.renderer.render(this.added, camera);
    this.frames++;
    this.onFrame();
  }
}
