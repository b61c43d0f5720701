/** The wall's place under a ray: found by search trees, or triangle by triangle until the worker has built them. */

import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshBasicMaterial } from "three";
import type { Intersection, Raycaster, Vector3 } from "three";
import { MeshBVH } from "three-mesh-bvh";
import type { Labels } from "../geometry/labels";
import type { Part, WallModel } from "../tiers/read_wall";
import type { WorkerClient } from "../tiers/worker_client";
import { yieldToPage } from "../tiers/yield_to_page";

export interface Hit {
  point: Vector3;
  hold: number;
}

const BOTH = new MeshBasicMaterial({ side: DoubleSide });

export class Picking {
  /** One a part; empty until they are built. */
  trees: MeshBVH[] = [];

  private readonly parts: Part[];
  /** The parts as their file has them: no edit changes these triangles. */
  private readonly geometries: BufferGeometry[];
  private labels: Labels | null;

  constructor({ parts, labels }: WallModel, worker: WorkerClient) {
    this.parts = parts;
    this.labels = labels;
    this.geometries = parts.map(({ patches }) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(patches.position, 3));
      return geometry.setIndex(new BufferAttribute(patches.index, 1));
    });
    void this.build(worker);
  }

  /** Give what is hit other labels. */
  relabel(labels: Labels): void {
    this.labels = labels;
  }

  private async build(worker: WorkerClient): Promise<void> {
    const built: MeshBVH[] = [];
    for (const [part, { patches }] of this.parts.entries()) {
      await yieldToPage(); // handing a mesh over takes a while
      const { position, index } = patches;
      const tree = await worker.ask("tree", { position, index });
      built.push(MeshBVH.deserialize(tree, this.geometries[part]!, { setIndex: false }));
    }
    this.trees = built;
  }

  /** The nearest triangle that the ray meets, from either side. */
  first(ray: Raycaster): Hit | null {
    let best: Hit | null = null;
    let nearest = Infinity;
    this.geometries.forEach((geometry, part) => {
      const tree = this.trees[part];
      const hit: Intersection | null | undefined = tree
        ? tree.raycastFirst(ray.ray, DoubleSide)
        : ray.intersectObject(new Mesh(geometry, BOTH))[0];
      if (!hit || hit.distance >= nearest || hit.faceIndex == null) return;
      nearest = hit.distance;
      const { index, patch } = this.parts[part]!.patches;
      const own = patch[index[3 * hit.faceIndex]!]!;
      const { x, y, z } = hit.point;
      best = { point: hit.point.clone(), hold: this.labels ? this.labels.at(own, x, y, z) : own };
    });
    return best;
  }
}
