/** How large textures may be on this device: a phone's browser ends pages that take too much memory, without a word. */

const SMALL_PX = 2048;
const SMALL_MEMORY_GB = 4;
const PHONE_PX = 500; // CSS pixels of a phone's shorter side, at most

export interface Device {
  /** Main memory in GB; only Chromium reports it, and at most 8. */
  memory: number | undefined;
  /** The screen's shorter side in CSS pixels. */
  side: number;
}

export function thisDevice(): Device {
  const { deviceMemory: memory } = navigator as { deviceMemory?: number };
  return { memory, side: Math.min(screen.width, screen.height) };
}

/** The longest side of a texture, in pixels; `limit`: the GPU's. */
export function longestSide(limit: number, { memory, side }: Device): number {
  const isSmall = memory === undefined ? side <= PHONE_PX : memory <= SMALL_MEMORY_GB;
  return isSmall ? Math.min(limit, SMALL_PX) : limit;
}
