/** The worker: what would keep the page from answering a finger. Built into the viewer. */

import { BufferAttribute, BufferGeometry } from "three";
import { MeshBVH } from "three-mesh-bvh";
import type { SerializedBVH } from "three-mesh-bvh";
import { bordersOf } from "../geometry/hold_borders";
import type { Borders } from "../geometry/hold_borders";
import { buffersOf, decodeTier } from "./decode";
import type { Source } from "./decode";
import type { TriangleMesh, Tier } from "./surface";
import { readStrip } from "./texture_strips";
import type { Strip } from "./texture_strips";

type Triangles = Pick<TriangleMesh, "position" | "index">;

/** The search tree of a mesh, for picking. It leaves the order of the triangles as it is. */
function treeOf({ position, index }: Triangles): SerializedBVH {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(position, 3));
  geometry.setIndex(new BufferAttribute(index, 1));
  return MeshBVH.serialize(new MeshBVH(geometry, { targetLeafSize: 8, indirect: true }), { cloneBuffers: false });
}

/** The jobs of the worker, each with its input and its result. */
export interface Jobs {
  read: [source: Source, done: Tier];
  strip: [strip: Strip, done: Uint8ClampedArray];
  tree: [mesh: Triangles, done: SerializedBVH];
  borders: [mesh: TriangleMesh, done: Borders];
}

export interface JobRequest<J extends keyof Jobs = keyof Jobs> {
  number: number;
  job: J;
  given: Jobs[J][0];
}

export type Answer = { number: number; done: Jobs[keyof Jobs][1] } | { number: number; failed: string; tooLarge: boolean };

type Done<J extends keyof Jobs> = [done: Jobs[J][1], handed: Transferable[]];

/** Each job returns its result, and the buffers of it to transfer instead of copy. */
const JOBS: { [J in keyof Jobs]: (given: Jobs[J][0]) => Done<J> | Promise<Done<J>> } = {
  async read(source) {
    const tier = await decodeTier(source);
    return [tier, buffersOf(tier)];
  },
  strip(wanted) {
    const strip = readStrip(wanted);
    return [strip, [strip.buffer]];
  },
  tree(mesh) {
    const tree = treeOf(mesh);
    return [tree, [...tree.roots, mesh.index.buffer as ArrayBuffer, (tree.indirectBuffer as Uint32Array).buffer as ArrayBuffer]];
  },
  borders(mesh) {
    const found = bordersOf(mesh);
    return [found, [found.near.buffer as ArrayBuffer, found.inside.buffer as ArrayBuffer]];
  },
};

async function work<J extends keyof Jobs>({ number, job, given }: JobRequest<J>): Promise<void> {
  const answer = (message: Answer, transfer: Transferable[] = []): void => postMessage(message, { transfer });
  try {
    const [done, handed] = await JOBS[job](given);
    answer({ number, done }, handed);
  } catch (error) {
    // A typed array that cannot be had is a RangeError.
    answer({ number, failed: (error as Error).message, tooLarge: error instanceof RangeError });
  }
}

// In the page's own script this is the page too: messages that arrive there are not for the worker.
if (typeof document === "undefined") addEventListener("message", ({ data }: MessageEvent<JobRequest>) => void work(data));
