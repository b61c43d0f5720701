/** The view as a URL fragment: chosen route, hold and camera. */

export interface LinkedView {
  route: number | null;
  hold: number | null;
  /** Eye and target, metres in the scan's frame. */
  camera: number[] | null;
}

export function parseView(hash: string): LinkedView {
  const values = new URLSearchParams(hash.replace(/^#/, ""));
  const whole = (key: string): number | null => {
    const text = values.get(key);
    return text !== null && /^\d{1,9}$/.test(text) ? Number(text) : null;
  };
  const camera = (values.get("cam") ?? "").split(",").map(Number);
  const usable = camera.length === 6 && camera.every((v) => Number.isFinite(v));
  return { route: whole("route"), hold: whole("hold"), camera: usable ? camera : null };
}

export function formatView(place: LinkedView): string {
  const parts: string[] = [];
  if (place.route !== null) parts.push(`route=${place.route}`);
  if (place.hold !== null) parts.push(`hold=${place.hold}`);
  if (place.camera) parts.push(`cam=${place.camera.map((v) => Number(v.toFixed(2))).join(",")}`);
  return parts.length ? `#${parts.join("&")}` : "";
}
