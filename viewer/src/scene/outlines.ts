/** Outlines around marked holds: a second drawing of the ids, and a line where they end. */

import { Color, Mesh, NearestFilter, PlaneGeometry, Scene, WebGLRenderTarget } from "three";
import type { Camera, Material, WebGLRenderer } from "three";
import { outlineMaterial } from "./materials";

export class Outlines {
  // Marks must not blend into each other: nearest, not linear.
  private readonly mask = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
  private readonly ink = outlineMaterial(this.mask.texture);
  private readonly square = new Mesh(new PlaneGeometry(2, 2), this.ink);
  private readonly over = new Scene();

  constructor() {
    this.square.frustumCulled = false;
    this.over.add(this.square);
  }

  /** In CSS pixels, and how many of the screen's are one of them. */
  resize(width: number, height: number, dense: number): void {
    this.mask.setSize(Math.round(width * dense), Math.round(height * dense));
    this.ink.uniforms["uDense"]!.value = dense;
    this.ink.uniforms["uPixel"]!.value.set(1 / this.mask.width, 1 / this.mask.height);
  }

  /** Over what is drawn; `masks` are the materials that draw marks instead of looks. */
  draw(renderer: WebGLRenderer, scene: Scene, camera: Camera, masks: Map<Mesh, Material>): void {
    const clear = renderer.getClearColor(new Color());
    const looks = new Map([...masks].map(([mesh]) => [mesh, mesh.material]));
    for (const [mesh, masked] of masks) mesh.material = masked;
    renderer.setRenderTarget(this.mask);
    renderer.setClearColor(0x000000, 1);
    renderer.clear();
    renderer.render(scene, camera);
    for (const [mesh, look] of looks) mesh.material = look;
    renderer.setRenderTarget(null);
    renderer.setClearColor(clear, 1);
    renderer.render(this.over, camera);
  }

  dispose(): void {
    this.mask.dispose();
    this.ink.dispose();
    this.square.geometry.dispose();
  }
}
