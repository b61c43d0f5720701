/** What lies under a ray: by search trees once they are built beside the page, before that by looking at each triangle. */

import { DoubleSide, Mesh, MeshBasicMaterial } from "three";
import type { BufferGeometry, Intersection, Raycaster, Vector3 } from "three";
import { MeshBVH } from "three-mesh-bvh";
import type { Background } from "./background";
import { breath } from "./breath";
import { netOf } from "./load";

export interface Hit {
  point: Vector3;
  hold: number;
  part: number;
  /** Triangle in the part's index. */
  triangle: number;
}

const BOTH = new MeshBasicMaterial({ side: DoubleSide });

export class Picking {
  /** One a part; empty until they are built. */
  trees: MeshBVH[] = [];

  constructor(
    readonly geometries: BufferGeometry[],
    worker: Background,
  ) {
    void this.build(worker);
  }

  private async build(worker: Background): Promise<void> {
    const built: MeshBVH[] = [];
    for (const geometry of this.geometries) {
      await breath(); // handing a net over takes a while
      const tree = await worker.ask("tree", netOf(geometry));
      built.push(MeshBVH.deserialize(tree, geometry, { setIndex: false }));
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
      const corner = geometry.getIndex()!.getX(3 * hit.faceIndex);
      const hold = Math.round(geometry.getAttribute("feature").getX(corner));
      best = { point: hit.point.clone(), hold, part, triangle: hit.faceIndex };
    });
    return best;
  }
}
