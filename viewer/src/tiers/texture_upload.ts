/** A tier's picture on its way to the GPU: strip by strip, so that the page answers fingers between two. */

import { DataTexture, FramebufferTexture, LinearFilter, NearestFilter, SRGBColorSpace, Vector2 } from "three";
import type { MagnificationTextureFilter, MinificationTextureFilter, Texture, WebGLRenderer, Wrapping } from "three";
import type { Picture } from "./surface";
import { longestSide, thisDevice } from "./texture_size";
import type { WorkerClient } from "./worker_client";
import { yieldToPage } from "./yield_to_page";

/** Room for a picture: three.js fills no texture of this kind itself, and leaves none of it in the page's memory. */
export function emptyTexture({ width, height, wrapS, wrapT, magFilter, minFilter }: Picture): Texture {
  return Object.assign(new FramebufferTexture(width, height), {
    wrapS: wrapS as Wrapping,
    wrapT: wrapT as Wrapping,
    magFilter: magFilter as MagnificationTextureFilter,
    minFilter: minFilter as MinificationTextureFilter,
    colorSpace: SRGBColorSpace,
    flipY: false,
  });
}

/** Fill a texture from the worker that read the picture; resolves to false where `signal` stopped it. */
export async function uploadTexture(
  renderer: WebGLRenderer,
  map: Texture,
  { number, width, height }: Picture,
  reader: WorkerClient,
  signal: AbortSignal,
): Promise<boolean> {
  const { capabilities } = renderer;
  const factor = Math.min(1, longestSide(capabilities.maxTextureSize, thisDevice()) / Math.max(width, height));
  const size = { width: Math.max(1, Math.floor(width * factor)), height: Math.max(1, Math.floor(height * factor)) };
  Object.assign(map.image as object, size);
  map.anisotropy = Math.min(8, capabilities.getMaxAnisotropy());
  map.generateMipmaps = false;
  renderer.initTexture(map);
  const stripAt = (from: number): Promise<Uint8ClampedArray> => reader.ask("strip", { number, ...size, from });
  let coming = stripAt(0);
  for (let from = 0; from < size.height; ) {
    const pixels = await coming;
    if (signal.aborted) return false;
    const strip = new DataTexture(pixels, size.width, pixels.length / (4 * size.width));
    const at = new Vector2(0, from);
    from += strip.image.height;
    if (from < size.height) coming = stripAt(from); // read while this one is sent
    await yieldToPage();
    if (signal.aborted) return false;
    // Smaller copies are made after the last strip alone.
    map.generateMipmaps = from >= size.height && map.minFilter !== LinearFilter && map.minFilter !== NearestFilter;
    renderer.copyTextureToTexture(strip, map, null, at);
  }
  return true;
}
