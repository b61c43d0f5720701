/**
 * The present look of each hold: one texel a feature id. Lighting up a route is one small
 * texture write; the geometry never changes.
 */

import { DataTexture, NearestFilter, RGBAFormat, UnsignedByteType } from "three";

export const STATE_WIDTH = 1024;

/** Outline kinds, in the green channel. */
export const Outline = { none: 0, route: 1, chosen: 2, marked: 3, cursor: 4 } as const;

export class HoldState {
  readonly texture: DataTexture;
  readonly count: number;
  private readonly data: Uint8Array;

  constructor(most: number) {
    this.count = most + 1;
    const height = Math.max(1, Math.ceil(this.count / STATE_WIDTH));
    this.data = new Uint8Array(STATE_WIDTH * height * 4);
    this.texture = new DataTexture(this.data, STATE_WIDTH, height, RGBAFormat, UnsignedByteType);
    this.texture.minFilter = NearestFilter;
    this.texture.magFilter = NearestFilter;
    this.reset();
  }

  /** Everything in full colour, no outlines. */
  reset(): void {
    for (let id = 0; id < this.count; id++) this.write(id, true, Outline.none);
    this.commit();
  }

  /** One hold's look: in full colour or faded, its outline, and its heat (0: none). */
  write(id: number, full: boolean, outline: number, heat = 0): void {
    if (id < 0 || id >= this.count) return;
    this.data[4 * id] = full ? 255 : 0;
    this.data[4 * id + 1] = outline;
    this.data[4 * id + 2] = heat;
    this.data[4 * id + 3] = 255;
  }

  /** Send what was written to the GPU. */
  commit(): void {
    this.texture.needsUpdate = true;
  }

  dispose(): void {
    this.texture.dispose();
  }
}
