/**
 * Pictures of tiers, in the worker that read them: given out as pixels, strip by strip. A whole picture at once
 * (64 MB) would keep the page from answering a finger while it goes to the GPU, and would be there twice.
 */

import type { Texture } from "three";
import type { Picture } from "./surface";

const STRIP = 2 ** 22; // bytes

export interface Strip {
  /** Number of the picture. */
  number: number;
  /** The size to which the whole picture is drawn, in pixels. */
  width: number;
  height: number;
  /** The strip's first row. */
  from: number;
}

interface Kept {
  image: ImageBitmap;
  /** Draws one strip. */
  pen: OffscreenCanvasRenderingContext2D | null;
}

const kept = new Map<number, Kept>();
let count = 0;

/** Keep a picture until its last row was read. */
export function keepPicture(map: Texture | null): Picture | null {
  if (!map) return null;
  const image = map.image as ImageBitmap;
  const { width, height } = image;
  const { wrapS, wrapT, magFilter, minFilter } = map;
  const number = count++;
  kept.set(number, { image, pen: null });
  return { number, width, height, wrapS, wrapT, magFilter, minFilter };
}

/** RGBA of the rows from one on, as many as a strip has. */
export function readStrip({ number, width, height, from }: Strip): Uint8ClampedArray<ArrayBuffer> {
  const one = kept.get(number)!;
  const rows = Math.max(1, Math.floor(STRIP / (4 * width)));
  const looks = { alpha: false, willReadFrequently: true };
  const pen = (one.pen ??= new OffscreenCanvas(width, rows).getContext("2d", looks)!);
  pen.drawImage(one.image, 0, -from, width, height);
  if (from + rows >= height) {
    one.image.close();
    kept.delete(number);
  }
  return pen.getImageData(0, 0, width, Math.min(rows, height - from)).data;
}
