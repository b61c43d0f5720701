/** A tier as it is drawn: its meshes, materials and the smooth borders of its holds. */

import { BufferAttribute, Mesh } from "three";
import type { Material, Scene, ShaderMaterial, Texture } from "three";
import { extended, labelled } from "../geometry/labels";
import type { Labels } from "../geometry/labels";
import { meshOf } from "../tiers/read_wall";
import type { Part, WallModel } from "../tiers/read_wall";
import type { WorkerClient } from "../tiers/worker_client";
import { yieldToPage } from "../tiers/yield_to_page";
import { maskMaterial, wallMaterial } from "./materials";
import type { WallLook } from "./materials";

export class TierMeshes {
  /** Each mesh with the material that draws marks instead of its look. */
  readonly masks = new Map<Mesh, Material>();
  private round = 0;

  constructor(
    readonly parts: Part[],
    private readonly scene: Scene,
    look: WallLook,
  ) {
    for (const part of parts) {
      const mesh = new Mesh(part.geometry, wallMaterial(part, look));
      this.masks.set(mesh, maskMaterial(look));
      scene.add(mesh);
    }
  }

  /** Smooth borders of the holds, found beside the page; `done` where they are what is drawn. */
  async shape(worker: WorkerClient, done: () => void): Promise<void> {
    const round = ++this.round;
    for (const { geometry } of this.parts) {
      await yieldToPage(); // handing a mesh over takes a while
      if (round !== this.round) return; // the tier is gone, or its holds have changed
      const { near, inside } = await worker.ask("borders", meshOf(geometry));
      if (round !== this.round) return;
      for (const [name, values] of [["near", near], ["depth", inside]] as const) {
        const attribute = geometry.getAttribute(name) as BufferAttribute;
        attribute.copyArray(values);
        attribute.needsUpdate = true;
      }
    }
    done();
  }

  /** Draw other labels. Until smooth borders are found, holds end where their triangles do. */
  relabel(labels: Labels): void {
    for (const { geometry, patches } of this.parts) {
      const { index, feature, parents } = labelled(patches, labels);
      geometry.dispose(); // what of it the GPU holds; it gets all of it anew
      for (const name of ["position", "uv", "color"]) {
        const given = geometry.getAttribute(name) as BufferAttribute | undefined;
        if (!given) continue;
        const { array, itemSize, normalized } = given;
        const longer = extended(array as Float32Array, itemSize, patches.patch.length, parents);
        geometry.setAttribute(name, new BufferAttribute(longer, itemSize, normalized));
      }
      geometry.setAttribute("feature", new BufferAttribute(feature, 1));
      geometry.setAttribute("near", new BufferAttribute(feature.slice(), 1));
      geometry.setAttribute("depth", new BufferAttribute(feature.map((id) => (id > 0 ? 1 : -1)), 1));
      geometry.setIndex(new BufferAttribute(index, 1));
    }
  }

  /** Free what the GPU holds. */
  dispose(): void {
    this.round++;
    for (const [mesh, masked] of this.masks) {
      this.scene.remove(mesh);
      const drawn = mesh.material as ShaderMaterial;
      (drawn.uniforms["uMap"]?.value as Texture | null)?.dispose();
      mesh.geometry.dispose();
      drawn.dispose();
      masked.dispose();
    }
  }
}

/** The highest id that a wall draws or names. */
export function highestId(wall: WallModel): number {
  let most = wall.most;
  for (const id of wall.tables.holds.keys()) if (id > most) most = id;
  return most;
}
